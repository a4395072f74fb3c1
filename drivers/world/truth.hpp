#pragma once
#include <array>
#include <cstdint>

#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

// Reports the truth of the emulation, for tests and the demo. The daemon must not read it.
namespace probebox::world {

// Counts everything delivered so far, exactly:
//   ticks  - missing - silent          + doubled + spurious - lost_edges == edges handed out
//   probe_samples - dropped_probe == deflections handed out;   encoder_latches - dropped_encoders == counts handed out
struct Ledger {
  std::uint64_t ticks{};
  std::uint64_t missing_edges{};   // a pulse that never was on the wire
  std::uint64_t silent_edges{};    // the same, while the line was stopped
  std::uint64_t doubled_edges{};   // extra edges
  std::uint64_t spurious_edges{};  // extra edges
  std::uint64_t lost_edges{};      // lost by the kernel: the line sequence number has a gap
  std::uint64_t outlier_edges{};   // much later than the others, handed out
  std::uint64_t clock_jumps{};
  std::uint64_t trigger_edges{};
  std::uint64_t setter_edges{};
  std::uint64_t probe_samples{};
  std::uint64_t dropped_probe{};
  std::uint64_t encoder_latches{};  // each axis counts
  std::uint64_t dropped_encoders{};
  std::uint64_t drift_readings{};
  std::uint64_t dropped_drift{};
  std::uint64_t index_edges{};
};

struct Truth {
  Vector3 tau_machine_s{};
  double tau_probe_s{};
  Vector3 tau_s{};  // tau_machine - tau_probe, what the box can find: (A1)
  Vector3 sphere_centre_mm{};
  double effective_radius_mm{};   // datum sphere and stylus ball
  Vector3 part_axis_point_mm{};   // a point of the rotary axis C
  Vector3 part_axis{};            // its direction, unit
  Vector3 table_axis_point_mm{};  // the same of the axis that the table tilts about
  Vector3 table_axis{};
  Matrix3 gain{};
  double drift_ppm{};  // of the true period against the nominal one, now
  Ledger ledger;
};

// True time of a tick of the master clock.
struct TrueTick {
  Tick tick{};
  MonoTime at{};
  double period_ns{};  // until the next one
};

enum class EdgeOrigin : std::uint8_t { tick, doubled, spurious };

// Origin of an edge of the sync line. `tick` is undefined for a spurious edge.
struct TrueEdge {
  std::uint32_t line_sequence{};
  EdgeOrigin origin{};
  Tick tick{};
};

}  // namespace probebox::world
