#include "firmware/metrology/fit/rounded_means.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/digits.hpp"

namespace probebox::metrology {
namespace {

constexpr double kCounts = 0.1;          // of the scatter of a reading
constexpr double kUsualDigit_mm = 0.01;  // of a control (chosen): 145 may be 145.000
constexpr double kLeastShare = 1e-3;     // a tenth of the coarsest digit is below 1 nm then

// Digits of the three columns, mm. Few readings to 0.01 mm may all end in 0: coarser digits have to be sure.
std::array<double, 3> digitsInUse(const Table& table, const RoundedCoordinates& coordinates) {
  std::array<ShownDigit, 3> shown;
  double chance = 1.0, finest_mm = 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (coordinates.share[static_cast<Eigen::Index>(k)] < kLeastShare) continue;
    const auto& values = *table.column(coordinates.columns[k]);
    shown[k] = shownDigit(values, kUsualDigit_mm);
    if (shown[k].constant && values.front() == 0.0) continue;  // not measured
    chance *= shown[k].chance;
    if (shown[k].chance < 1.0) finest_mm = std::min(finest_mm, shown[k].digit);
  }
  std::array<double, 3> digits_mm{};
  for (std::size_t k = 0; k < 3; ++k) {
    double most_mm = kUsualDigit_mm;
    if (chance < kCoarseByChance) most_mm = shown[k].constant ? finest_mm : shown[k].digit;
    digits_mm[k] = std::min(shown[k].digit, most_mm);
  }
  return digits_mm;
}

// Root of the mean square of the coordinates that show their noise, over that of all.
double wideningBy(const Eigen::Vector3d& scatter_mm, const std::array<bool, 3>& hidden) {
  double squares = 0.0, count = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (hidden[k]) continue;
    squares += std::pow(scatter_mm[static_cast<Eigen::Index>(k)], 2);
    count += 1.0;
  }
  const double all = scatter_mm.squaredNorm() / 3.0;
  if (count == 0.0 || all == 0.0) return 1.0;
  return std::sqrt(std::max(1.0, squares / count / all));
}

}  // namespace

RoundingOfMeans roundingOfMeans(const Table& table, const RoundedCoordinates& coordinates, const Sigma& sigma,
                                Answer& answer) {
  RoundingOfMeans rounding;
  if (sigma.stated || answer.result().estimates.front().sd.empty()) return rounding;
  struct Hidden {
    std::string columns;
    double sd_mm{};
  };
  std::map<double, Hidden> by_digit;
  std::array<bool, 3> is_hidden{};
  const auto digits_mm = digitsInUse(table, coordinates);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    if (coordinates.share[at] < kLeastShare) continue;
    const double digit_mm = digits_mm[k];
    const double sd_mm = roundingSd(coordinates.scatter_mm[at], digit_mm);
    rounding.sd_mm[at] = coordinates.share[at] * sd_mm;
    is_hidden[k] = sd_mm > kCounts * coordinates.scatter_mm[at];
    if (!is_hidden[k]) continue;
    auto& hidden = by_digit[digit_mm];
    hidden.columns += (hidden.columns.empty() ? "" : ", ") + std::string{coordinates.columns[k]};
    hidden.sd_mm = std::max(hidden.sd_mm, rounding.sd_mm[at]);
  }
  for (const auto& [digit_mm, hidden] : by_digit) {
    answer.warn("the readings of " + hidden.columns + " have digits of " + text(digit_mm) +
                " mm, which hide their noise: what rounding leaves of their mean, " + text(hidden.sd_mm) +
                " mm, is in the sd; state sigma_mm, or read more digits");
  }
  rounding.widening = wideningBy(coordinates.scatter_mm, is_hidden);
  return rounding;
}

Eigen::Vector3d scatterAlong(const Fit& fit, const Eigen::MatrixX3d& along, const Sigma& sigma) {
  const Eigen::MatrixX3d weights = along.cwiseAbs2();
  const Eigen::Vector3d squares = weights.transpose() * fit.residuals.cwiseAbs2();
  const double spare = static_cast<double>(fit.dof) / static_cast<double>(fit.residuals.size());
  return sigma.value * (squares.cwiseQuotient(weights.colwise().sum().transpose()) / spare).cwiseSqrt();
}

void widen(Result& result, const Eigen::MatrixXd& slopes, const Eigen::VectorXd& sds, double widening) {
  const Eigen::MatrixXd scaled = slopes * sds.asDiagonal();
  const Eigen::MatrixXd added = scaled * scaled.transpose();
  Eigen::Index row = 0;
  for (auto& estimate : result.estimates) {
    for (double& sd : estimate.sd) {
      sd = std::hypot(widening * sd, std::sqrt(added(row, row)));
      ++row;
    }
  }
  if (!result.covariance) return;
  const auto entries = added.reshaped<Eigen::RowMajor>();
  for (Eigen::Index k = 0; k < added.size(); ++k) {
    double& entry = result.covariance->values[static_cast<std::size_t>(k)];
    entry = widening * widening * entry + entries[k];
  }
}

// The characteristic function of the noise damps the saw-tooth error. Rounding alone makes up to a quarter of a step
// squared of the variance, where the readings alternate between two steps: only what is above that is noise for
// certain.
double roundingSd(double sd_reading, double step) {
  const double noise_variance = std::max(0.0, sd_reading * sd_reading - step * step / 4);
  const double damped = std::exp(-2 * std::pow(std::numbers::pi / step, 2) * noise_variance);
  return step / std::sqrt(12.0) * damped;
}

}  // namespace probebox::metrology
