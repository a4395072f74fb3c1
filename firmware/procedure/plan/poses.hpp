#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/procedure/plan/sides.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"

// Angles of the rotary axes for each reading of a method, and the sides of the feature that can be touched there.
namespace probebox::procedure {

struct Pose {
  std::array<double, 3> angles_rad{};  // A B C
  std::uint16_t ball{};                // of the part, from 1; 0 for another feature
  BMoves b_moves{};
  std::uint32_t tool{};  // 0: any tool that carries the probe
  bool by_shank{};
  std::uint16_t mount{};  // of a plate on the table, from 1; 0: as the part is
  capture::MethodNote note{};
  bool sides_stand{};  // those of a feature that stands in the machine: they do not turn with the head
};

// Poses of a run, one for each reading, for options without zeros (withDefaults).
struct Poses {
  std::size_t (*count)(const ProcedureOptions&, const LoopState&);
  Pose (*at)(const ProcedureOptions&, const LoopState&, std::size_t index);
};

inline constexpr double kHalfTurn_rad = kTurn_rad / 2;

// One reading with A, B and C at 0: the probe's gain and lobes are those of a probe that is not turned.
extern const Poses kAtZero;
// One ball, A and C at 0 and 180 degrees each: C turns between any two readings, so no two share its stop.
extern const Poses kTwoByTwo;
Pose twoByTwo(std::size_t index);

// C at `index` of `options.angles` angles, spread over the arc from from_rad on.
double angleOfC(const ProcedureOptions& options, double from_rad, std::size_t index);

// Lists of the options, never longer than their arrays.
std::span<const double> speedsOf(const ProcedureOptions& options);
std::span<const double> anglesOfB(const ProcedureOptions& options);
std::span<const std::uint32_t> toolsOf(const ProcedureOptions& options);

// Puts the probe into one of the tools, or uses the shank in place of the last one.
void carry(Pose& pose, const ProcedureOptions& options, std::size_t tool);

// Sides to touch, in machine axes. They turn with a swivelling head. The side of the ball's stem is omitted; the stem
// holds the ball from below and tilts with a table. A shank touches across the tool only, and not from below, where the
// parts under it would hit the stem.
class Sides {
 public:
  Sides(std::span<const Side> all, const ProcedureOptions& options, const Pose& pose);
  std::span<const Side> list() const { return std::span{sides_}.first(count_); }

 private:
  std::array<Side, kMostSides> sides_{};
  std::size_t count_{};
};

}  // namespace probebox::procedure
