#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/modbus/register.hpp"

// The register map of the CNC's Modbus line, as data for the image, the decoding of writes, and MODBUS.md. A released
// address never changes its meaning; the first block (0 to 37) is fixed forever.
namespace probebox::modbus {

inline constexpr std::uint16_t kMagic = 0x5042;
inline constexpr std::uint16_t kMapVersion = 1;
// Addresses below this that are not in the map read 0; addresses from here on are refused.
inline constexpr std::size_t kRegisterCount = 8600;

// Addresses that programs name; the others stand in the map alone.
namespace address {
enum : std::uint16_t {
  magic = 0,
  status = 2,
  sequence = 3,
  heartbeat = 4,
  correction_i16 = 5,  // X; Y and Z follow, as with every triple
  correction_offset = 8,
  mask = 12,
  correction_f32 = 16,
  correction_i32 = 32,
  sources_invalid = 42,
  settled = 48,
  delay_f32 = 64,
  delay_sd_f32 = 70,
  delay_i32 = 80,
  delay_result = 92,
  calibration_state = 96,
  calibration_method = 97,
  calibration_run = 98,
  calibration_step = 100,
  calibration_result = 102,
  calibration_refusal = 104,
  samples_produced = 116,
  samples_lost_at_source = 118,
  samples_lost_in_queue = 120,
  word_order = 128,
  home_position = 130,
  home_axes = 136,
  home_commit = 137,
  inhibit = 138,
  marker_run = 144,
  marker_step = 146,
  marker_phase = 147,
  marker_speed = 148,
  marker_tool = 149,
  marker_angle = 150,
  marker_at_rest = 156,
  marker_commit = 157,
  centreline_here = 160,
  centreline_slope = 164,
  centreline_sd = 168,
  centreline_slope_sd = 172,
  centreline_z = 176,
  pose_angle = 240,
  pose_told = 246,
  pose_tool = 247,
  pose_tool_length = 248,
  pose_commit = 250,
  request_method = 800,
  request_speeds = 801,
  request_speed = 802,
  request_overtravel = 810,
  request_clearance = 811,
  request_approach = 812,
  request_arc = 813,
  request_angles = 814,
  request_balls = 815,
  request_axis = 816,
  request_turns = 817,
  request_tool = 818,
  request_read_by = 819,
  request_stations = 820,
  request_mounts = 821,
  request_contacts = 830,
  request_spindle = 831,
  request_of = 834,
  request_what = 836,
  request_commit = 837,
  request_answered = 838,
  request_outcome = 839,
  request_refusal = 840,
  request_number = 842,
  request_waits = 844,
  step_state = 848,
  step_number = 849,
  step_run = 850,
  step_kind = 852,
  step_feature = 853,
  step_ball = 855,
  step_tool = 856,
  step_mount = 857,
  step_bits = 858,
  step_fault = 860,
  step_rest = 862,
  step_normal = 864,
  step_retract = 870,
  step_overtravel = 876,
  step_clearance = 878,
  step_run_out = 880,
  step_speed = 882,
  step_travel = 884,
  step_shank = 886,
  step_angle = 888,
  step_target = 896,
  step_scan_arcs = 908,
  step_scan_bits = 909,
  step_scan_start = 910,
  step_scan_ramp = 912,
  step_scan_radius = 914,
  step_scan_arc = 918,
  step_turn_line = 934,
  step_turn_to = 936,
  step_turn_speed = 938,
};
}  // namespace address

// Corrections saturate here in every format, so that all three agree.
inline constexpr double kCorrectionLimitMm = 3.2767;

// All entries, by rising address; a table is represented by its first row.
std::span<const Register> registers();

// The entry that begins at this address, in any row of a table, or null.
const Register* find(std::uint16_t address);

// The entry whose registers include this address, or null.
const Register* covering(std::uint16_t address);

// Encodes `value`, in the register's unit, into one or two registers in `order`. Saturates at the limits of its kind.
void encode(const Register& entry, double value, WordOrder order, std::span<std::uint16_t> image);
// The same at another address: another row of a table.
void encodeAt(const Register& entry, std::uint16_t address, double value, WordOrder order,
              std::span<std::uint16_t> image);
double decode(const Register& entry, WordOrder order, std::span<const std::uint16_t> image);

}  // namespace probebox::modbus
