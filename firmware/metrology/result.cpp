#include "firmware/metrology/result.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
  double squares = 0.0;
  for (const double figure : estimates.front().design) squares += figure * figure;
  return std::sqrt(squares / static_cast<double>(estimates.front().design.size()));
}

}  // namespace probebox::metrology
