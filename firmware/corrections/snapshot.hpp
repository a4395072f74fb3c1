#pragma once
#include <array>
#include <cstdint>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

// The system delay in force, per axis ((A1): tau = t_machine - t_probe), with its standard deviation (k = 1).
struct DelayInForce {
  bool calibrated{};
  std::uint64_t result_id{};
  std::array<double, kLinearAxes> tau_s{};
  std::array<double, kLinearAxes> sd_s{};
};

// The last calibration, for a controller that has no screen of its own.
enum class CalibrationState : std::uint16_t {
  idle = 0,
  running = 1,
  proposed = 2,
  accepted = 3,
  refused = 4,
  aborted = 5
};

// Everything that a CNC may read, as of one instant. Published whole: a reader never sees half of one and half of
// another. Corrections are in machine axes, radius, mm, to be ADDED to the commanded position.
struct Snapshot {
  bool valid{};
  bool degraded{};
  bool clock_locked{};
  bool centreline_calibrated{};
  bool screw_sensors_good{};
  bool loss_seen{};
  bool referenced{};
  bool inhibited{};  // a cut is on: no result comes into force
  std::array<double, kLinearAxes> correction_mm{};
  std::uint16_t mask{};       // sources that are summed: bit 0 screw, 1 swivel, 2 rotary, 3 centreline, fixed for ever
  std::uint16_t sequence{};   // +1 whenever any correction changes
  std::uint16_t heartbeat{};  // +1 every 0.1 s, fed by the whole chain from source to corrections
  std::uint64_t age_ms{};
  DelayInForce delay{};
  ClockState clock_state{};
  std::uint32_t clock_sigma_ns{};
  std::uint64_t produced_samples{};
  std::uint64_t lost_at_source_samples{};
  std::uint64_t lost_in_queue_samples{};
  CalibrationState calibration{};
  std::uint16_t calibration_method{};  // number of the method, as procedure lists them
  std::uint32_t calibration_run{};
  std::uint32_t calibration_step{};
  std::uint32_t calibration_steps{};
  std::uint64_t calibration_result_id{};
  MonoTime at{};
};

}  // namespace probebox::corrections
