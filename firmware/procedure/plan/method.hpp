#pragma once
#include <cstdint>

namespace probebox::procedure {

// Numbers of the methods in events and registers: append only.
enum class Method : std::uint16_t {
  none = 0,
  delay_multi_speed = 1,
  delay_known_sphere = 2,
  delay_plates = 3,
  delay_per_axis = 4,
  delay_non_normal = 5,
  delay_in_out = 6,
  centreline = 7,
  c_axis_alignment = 8,
  selftest = 9,
  screw_calibration = 10,
  spindle_offset_2x2 = 11,
  spindle_offset_four = 12,
  centreline_limited_access = 13,
  periodic_check = 14,
  rotary_axis_errors = 15,
  table_pivot = 16,
  swivel_error = 17,
  head_pivot = 18,
  a_axis_alignment = 19,
  tool_setter = 20,
  tool_assembly = 21,
  sensor_head_calibration = 22,
  centreline_by_steps = 23,
};

// What must be known about the features before a method can run.
enum class Needs : std::uint8_t {
  nothing,
  sphere_diameter,
  plates_gap,
  delay_in_force,
  screw,
  checked_ball,  // this and all below also need a delay in force
  ball_plate,
  tilting_table,
  swivel_lengths,  // a swivelling head, and the probe in tools of several lengths
  swivel_head,     // and where its ball stands
  probe_lengths,
  tool_setter,
  rim_ball,
  measuring_unit,  // a tool setter at a known position, and the tool's parts
  sensor_head,
};

}  // namespace probebox::procedure
