#include "firmware/metrology/result.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/estimate_parts.hpp"

namespace probebox::metrology {

Estimate Estimate::scalar(std::string key, double value, std::optional<double> sd) {
  return {.key = std::move(key),
          .shape = Shape::scalar,
          .values = {value},
          .sd = sd ? std::vector<double>{*sd} : std::vector<double>{},
          .columns = 1};
}

Estimate Estimate::vector(std::string key, std::vector<double> values, std::vector<double> sd) {
  return {
      .key = std::move(key), .shape = Shape::vector, .values = std::move(values), .sd = std::move(sd), .columns = 1};
}

Estimate Estimate::matrix(std::string key, std::size_t columns, std::vector<double> values, std::vector<double> sd) {
  return {.key = std::move(key),
          .shape = Shape::matrix,
          .values = std::move(values),
          .sd = std::move(sd),
          .columns = columns};
}

const Estimate* Result::find(std::string_view key) const {
  for (const auto* list : {&estimates, &also}) {
    const auto found = std::ranges::find(*list, key, &Estimate::key);
    if (found != list->end()) return &*found;
  }
  return nullptr;
}

std::optional<double> Result::designFigure() const {
  if (estimates.empty() || estimates.front().design.empty()) return std::nullopt;
  const auto part = partsOf(estimates.front()).front();
  double squares = 0.0;
  for (const auto k : part.at) squares += estimates.front().design[k] * estimates.front().design[k];
  return std::sqrt(squares / static_cast<double>(part.at.size()));
}

}  // namespace probebox::metrology
