#include "firmware/metrology/touch/one_speed.hpp"

#include <algorithm>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

namespace {

// mm/s, of all touches; nothing if they differ.
std::optional<double> oneSpeedOf(const Dataset& dataset) {
  const Table* touches = dataset.table("touches");
  const auto* speeds = touches == nullptr ? nullptr : touches->column(column::kSpeed);
  if (speeds == nullptr || speeds->empty()) return std::nullopt;
  const auto [slowest, fastest] = std::ranges::minmax(*speeds);
  return slowest < fastest || !(slowest > 0.0) ? std::nullopt : std::optional{slowest};
}

std::string microsecondsPerMicrometre(double speed_mm_s) {
  return text(1e3 / (2.0 * speed_mm_s)) + " us of tau";
}

}  // namespace

std::optional<std::string> lostMotionAtOneSpeed(const Dataset& dataset) {
  const auto speed = oneSpeedOf(dataset);
  if (!speed) return std::nullopt;
  return "tau separately from lost motion of the axes: at one speed 1 um of it is " +
         microsecondsPerMicrometre(*speed) + " (A7b); touch at a second speed too";
}

std::optional<std::string> sizeBiasAtOneSpeed(const Dataset& dataset) {
  if (dataset.table("article")) return std::nullopt;
  const auto speed = oneSpeedOf(dataset);
  if (!speed) return std::nullopt;
  return "tau separately from an error of the known size: at one speed 1 um of size is " +
         microsecondsPerMicrometre(*speed) + " (A9)";
}

}  // namespace probebox::metrology
