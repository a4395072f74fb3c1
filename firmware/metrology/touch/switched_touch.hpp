#pragma once
#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Times of contact on the way in and release on the way out of a switched device, on the stamps of table machine.
inline constexpr MethodColumn kEdgesColumns[]{
    column::kTouch, {"contact_s", ColumnRole::stamp}, {"release_s", ColumnRole::stamp}};

// Positions that each side of an edge needs, and the way on which they are looked for.
inline constexpr std::size_t kFewestAtAnEdge = 5;
inline constexpr double kWayAtAnEdge_mm = 0.2;

// A touch measured by the edges of a switch, reduced to one position.
struct SwitchedTouch {
  Eigen::Vector3d normal;  // outward
  Eigen::Vector3d at_mm;   // machine position: mean of contact and release, each weighted by the speed of the other way
  double sd_mm{};          // of at_mm along the way, from the noise of the positions (k = 1)
  double speed_mm_s{};     // as planned, in and out
  double late_s{};         // delay of the edges after the probe's samples, including their hysteresis
};

// Computes contact positions. Tables machine, touches, edges, one row of touches and edges per touch in the same order.
// Lines through the positions within 0.2 mm of either edge give the machine position, corrected by the delay in force,
// P = M + T v (A2). A remaining delay displaces both in opposite directions, each by its speed, so the mean weighted by
// the speed of the other way is free of it: tau_s only shifts the zero of late_s. tau_s: X Y Z. Refuses, naming
// the touch: missing-touch, too-few-samples (five per edge), speed-not-constant (2 %), speed-differs (20 %, or the
// wrong direction), off-the-line (a position that the noise of the others does not explain), coarse-stamps (edges that
// are rounded to more than 1 um of way).
Outcome<std::vector<SwitchedTouch>, Refusal> switchedTouches(const Dataset& dataset,
                                                             const std::array<double, 3>& tau_s);

}  // namespace probebox::metrology
