#pragma once
#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// When a device that is touched closed its contact on the way in, and opened it on the way out, on the stamps of
// table machine.
inline constexpr std::string_view kEdgesColumns[]{"touch", "contact_s", "release_s"};

// A touch that the edges of a switch tell, reduced to one place.
struct SwitchedTouch {
  Eigen::Vector3d normal;  // outward
  Eigen::Vector3d at_mm;   // machine position: the mean of contact and release
  double late_s{};         // so much later than the probe's samples the edges come, their hysteresis in it
};

// Tables machine, touches, edges; a row of touches and of edges each touch, in the same order. Lines through the
// positions within 0.2 mm of way about either edge say where the machine stood; the delay in force is taken out of
// both, P = M + T v (A2). What the edges are late by beside it displaces them to opposite sides at the same speed, so
// their mean is free of it. tau_s: X Y Z. Refuses, naming the touch: missing-touch, too-few-samples (five about an
// edge), speed-not-constant (halves of a line that differ by 2 % and more than their noise), speed-differs (from the
// nominal by more than 20 %, or the wrong way).
Outcome<std::vector<SwitchedTouch>, Refusal> switchedTouches(const Dataset& dataset,
                                                             const std::array<double, 3>& tau_s);

}  // namespace probebox::metrology
