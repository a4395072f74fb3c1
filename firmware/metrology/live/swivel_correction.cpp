#include "firmware/metrology/live/swivel_correction.hpp"

#include <cmath>
#include <vector>

#include "protocol/units/angle.hpp"
#include "protocol/units/result_keys.hpp"

namespace probebox::metrology {

Eigen::Vector3d SwivelTerms::at(double swivel_rad, double length_mm) const {
  return (sine + length_mm * sine_per_mm) * std::sin(swivel_rad) +
         (rest + length_mm * rest_per_mm) * (1.0 - std::cos(swivel_rad));
}

Outcome<SwivelCorrection, Refusal> SwivelCorrection::from(const Result& result, bool by_angle) {
  const Estimate* terms = result.find(result_key::kSwivelTerms);
  const Estimate* left = result.find(result_key::kLeftByAngle);
  if (!terms || terms->values.size() != 12 || (by_angle && !left)) {
    return Refusal{"wrong-result",
                   "a swivel correction needs a result of the method swivel-error: calibrate that first"};
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> rows{terms->values.data()};
  SwivelCorrection correction{SwivelTerms{rows.col(0), rows.col(1), rows.col(2), rows.col(3)}};
  if (!by_angle) return correction;
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> errors;
  for (std::size_t k = 0; k + 4 <= left->values.size(); k += 4) {
    angles.push_back(radians(left->values[k]));
    errors.emplace_back(left->values[k + 1], left->values[k + 2], left->values[k + 3]);
  }
  TRY(const auto table, AngleTable<3>::make(angles, errors, Between::linear));
  correction.left_ = table;
  return correction;
}

std::optional<Eigen::Vector3d> SwivelCorrection::at(std::optional<double> swivel_rad,
                                                    std::optional<double> length_mm) const {
  if (!swivel_rad || !length_mm || !std::isfinite(*swivel_rad) || !std::isfinite(*length_mm)) return std::nullopt;
  Eigen::Vector3d sum = terms_.at(*swivel_rad, *length_mm);
  if (!left_) return sum;
  const auto left = left_->at(*swivel_rad);
  if (!left) return std::nullopt;
  return sum + *left;
}

}  // namespace probebox::metrology
