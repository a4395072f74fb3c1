#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::world {

enum class FaultKind : std::uint8_t {
  drop_probe,      // no probe samples: their sequence numbers run on
  drop_encoders,   // no encoder latches: their sequence numbers run on
  stop_sync,       // the master clock's line is silent
  lose_edges,      // the kernel's buffer overruns: edges are lost, and their sequence numbers are missing
  double_edges,    // every tick makes two edges
  drop_drift,      // the sensors of the screws are silent
  stick_encoders,  // the counts stay constant while the axes move
  freeze_probe,    // every sample repeats the last one
  shake_probe,     // noise a hundred times as large
  jump_clock,      // once: the master clock's phase steps by `jump`
  drop_angles,     // no latches of the part spindle's encoder: their sequence numbers run on
};

// Describes a fault that begins at `at` and lasts for `duration`.
struct Fault {
  FaultKind kind{};
  MonoTime at{};
  Nanoseconds duration{};
  Nanoseconds jump{};
};

}  // namespace probebox::world
