#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/world.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

using board::FaultKind;
using board::Jitter;

// Configures the emulated machine: its description, and what only those know who run it. The box does not know any of
// it.
struct Config : board::World {
  board::Machine machine{};  // its senses of the encoders, reference marks and ball screws are true
  MonoTime start{};          // the world begins here
  bool trigger_line{true};   // edges of role trigger, line 0: active while the stylus of a scanning probe is in contact
  // False: edges are not events; they are polled as physical edges, for a line that another component stamps.
  bool edges_as_events{true};
  double drift_rate_hz{20};  // of the sensor of each screw
  double c_power_up_deg{};   // what the encoder of C shows at 0
};

}  // namespace probebox::world
