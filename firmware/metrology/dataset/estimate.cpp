#include "firmware/metrology/dataset/estimate.hpp"

#include <utility>

#include "protocol/units/result_keys.hpp"

namespace probebox::metrology {

Estimate Estimate::scalar(std::string_view key, double value, std::optional<double> sd) {
  return {.key = std::string{key},
          .shape = Shape::scalar,
          .values = {value},
          .sd = sd ? std::vector<double>{*sd} : std::vector<double>{},
          .columns = 1};
}

Estimate Estimate::vector(std::string_view key, std::vector<double> values, std::vector<double> sd) {
  return {
      .key = std::string{key}, .shape = Shape::vector, .values = std::move(values), .sd = std::move(sd), .columns = 1};
}

Estimate Estimate::matrix(std::string_view key, std::size_t columns, std::vector<double> values,
                          std::vector<double> sd) {
  return {.key = std::string{key},
          .shape = Shape::matrix,
          .values = std::move(values),
          .sd = std::move(sd),
          .columns = columns};
}

std::vector<EstimatePart> partsOf(const Estimate& estimate) {
  constexpr std::size_t kErrors = 6;
  const bool two_units = estimate.key == result_key::kSixErrors && estimate.columns == kErrors;
  std::vector<EstimatePart> parts{{estimate.key, {}}};
  if (two_units) parts = {{"translations_mm", {}}, {"rotations_rad", {}}};
  for (std::size_t k = 0; k < estimate.values.size(); ++k) {
    parts[two_units && k % kErrors >= kErrors / 2 ? 1 : 0].at.push_back(k);
  }
  return parts;
}

}  // namespace probebox::metrology
