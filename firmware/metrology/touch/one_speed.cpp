#include "firmware/metrology/touch/one_speed.hpp"

#include <algorithm>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

std::optional<std::string> sizeBiasAtOneSpeed(const Dataset& dataset) {
  if (dataset.table("article")) return std::nullopt;
  const Table* touches = dataset.table("touches");
  const auto* speeds = touches == nullptr ? nullptr : touches->column(column::kSpeed);
  if (speeds == nullptr || speeds->empty()) return std::nullopt;
  const auto [slowest, fastest] = std::ranges::minmax(*speeds);
  if (slowest < fastest || !(slowest > 0.0)) return std::nullopt;
  return "tau separately from an error of the known size: at one speed 1 um of size is " + text(1e3 / (2.0 * slowest)) +
         " us of tau (A9)";
}

}  // namespace probebox::metrology
