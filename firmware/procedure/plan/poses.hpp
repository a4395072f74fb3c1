#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/procedure/plan/method_table.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"

// Angles of the rotary axes for each reading of a method, and the sides of the feature that can be touched there.
namespace probebox::procedure {

// Options of a run, with the method's defaults for zeros. Points into row and options.
struct Chosen {
  std::span<const double> speeds_mm_s;
  double overtravel_mm{};
  double clearance_mm{};
  double approach_rad{};
  double arc_rad{};
  std::uint16_t angles{};
  std::uint16_t balls{};
  std::uint32_t tool{};            // that is measured
  std::array<double, 3> b_axis{};  // axis of B, right-handed
  std::span<const double> b_angles_rad;
  std::span<const std::uint32_t> tools;
  double shank_height_mm{};  // height at which the last tool touches with its shank; 0: it does not
  double c_on_line_rad{};    // how C stands at the zero of the first loop
  RimLoops loops{};
};
Chosen chosen(const MethodRow& row, const ProcedureOptions& options);

// Tests whether the method uses several angles of C over the range --arc.
bool spreadsC(const MethodRow& row);
// Tests whether --angles sets the number of angles.
bool countsAngles(const MethodRow& row);
// Tests whether the method uses several angles of B, as described in machine.toml.
bool turnsB(const MethodRow& row);

// Tests whether the probe is carried by several tools in turn.
bool changesTools(const MethodRow& row);

struct Pose {
  std::array<double, 3> angles_rad{};  // A B C
  std::uint16_t ball{};                // of the part, from 1; 0 for another feature
  BMoves b_moves{};
  std::uint32_t tool{};  // 0: any tool that carries the probe
  bool by_shank{};
  capture::RimStep rim{};
};
std::size_t poseCount(const MethodRow& row, const Chosen& with);
Pose poseOf(const MethodRow& row, const Chosen& with, std::size_t index);

// Sides to touch, in machine axes. They turn with a swivelling head. The side of the ball's stem is omitted; the stem
// holds the ball from below and tilts with a table. A shank touches across the tool only, and not from below, where the
// parts under it would hit the stem.
class Sides {
 public:
  Sides(const MethodRow& row, const Chosen& with, const Pose& pose);
  std::span<const Side> list() const { return std::span{sides_}.first(count_); }

 private:
  std::array<Side, std::max(kSphereSides.size(), kSetterSides.size())> sides_{};
  std::size_t count_{};
};

}  // namespace probebox::procedure
