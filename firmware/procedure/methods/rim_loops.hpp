#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/tolerances.hpp"

// Loops of centreline-by-steps: a ball on the rim of a large part (docs/metrology.md B.11). Angles are clockwise.
namespace probebox::procedure {

// Known loops, at most kMostRimLoops: each starts from the zero of C that the previous one found.
struct RimLoops {
  std::size_t count{1};
  std::array<double, kMostRimLoops> zeros_rad{};  // clockwise from c_deg of [rim_ball]
  bool closes{};  // after the last loop the ball is read at its zero, which ends the run
  // The first zero comes from contacts by turning C; else it is where the ball was put by hand.
  bool contacted{};

  friend bool operator==(const RimLoops&, const RimLoops&) = default;
};
constexpr LoopState stateOf(const RimLoops& loops) {
  LoopState state{{static_cast<double>(loops.count), loops.closes ? 1.0 : 0.0}};
  for (std::size_t k = 0; k < kMostRimLoops; ++k) state.values[2 + k] = loops.zeros_rad[k];
  state.values[2 + kMostRimLoops] = loops.contacted ? 1.0 : 0.0;
  return state;
}
constexpr RimLoops rimLoops(const LoopState& state) {
  RimLoops loops{.count = static_cast<std::size_t>(state.values[0]), .closes = state.values[1] != 0};
  for (std::size_t k = 0; k < kMostRimLoops; ++k) loops.zeros_rad[k] = state.values[2 + k];
  loops.contacted = state.values[2 + kMostRimLoops] != 0;
  return loops;
}

// Place of a step in the loops.
struct RimStep {
  std::uint16_t loop{};  // loop number from 1; 0 before the first
  double zero_rad{};     // of C in this loop, clockwise from c_deg of [rim_ball]
  double c_rad{};        // from that zero
};
constexpr capture::MethodNote noteOf(const RimStep& step) {
  return {static_cast<double>(step.loop), step.zero_rad, step.c_rad};
}
constexpr RimStep rimStep(const capture::MethodNote& note) {
  return {.loop = static_cast<std::uint16_t>(note[0]), .zero_rad = note[1], .c_rad = note[2]};
}

}  // namespace probebox::procedure
