#include "firmware/metrology/dataset/probe_pose.hpp"

#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

bool isTurned(double angle_rad) {
  return std::abs(std::remainder(angle_rad, kTurn)) > kPoseTolerance_rad;
}

std::string inDegrees(double angle_rad) {
  return text(std::round(1e4 * degrees(angle_rad)) / 1e4) + " degrees";
}

}  // namespace

Outcome<std::optional<double>, Refusal> spindleOfProbe(const Dataset& dataset) {
  TRY(const auto b, configNumber(dataset, kProbeB.name));
  if (b && isTurned(*b)) {
    return Refusal{"head-swivelled",
                   "config key 'B_rad' is " + inDegrees(*b) +
                       ": the directions of the probe's channels turn with the head; measure with the "
                       "head level, at B = 0"};
  }
  TRY(const auto a, configNumber(dataset, kProbeA.name));
  TRY(const auto sense, configSense(dataset, "A_sense"));
  return a ? std::optional{sense * *a} : std::nullopt;
}

std::optional<Refusal> refuseTurnedProbe(const Dataset& dataset) {
  TRY(const auto a, spindleOfProbe(dataset));
  if (!a || !isTurned(*a)) return std::nullopt;
  return Refusal{"spindle-turned", "config key 'A_rad' is " + inDegrees(*a) +
                                       ": the directions of the probe turn with the spindle; turn A to 0 and measure "
                                       "again"};
}

}  // namespace probebox::metrology
