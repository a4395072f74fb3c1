#include "firmware/metrology/fit/points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

constexpr double kResidualFloor = 1e-6;  // mm; what the digits of a case file may round away

// Sigmas that the worst of so many honest residuals exceeds in one table of a thousand; at least 4.
double farthestHonest(Eigen::Index points) {
  double limit = 4.0;
  while (static_cast<double>(points) * std::erfc(limit / std::numbers::sqrt2) > kFalseAlarm && limit < 10.0)
    limit += 0.1;
  return limit;
}

}  // namespace

Rows3 pointRows(const Table& table) {
  return columnsOf(table, column::kPosition);
}

std::optional<Refusal> equalPoints(const Eigen::MatrixXd& points) {
  const auto order = [&](Eigen::Index i, Eigen::Index k) {
    for (const double difference : points.row(i) - points.row(k)) {
      if (difference != 0) return difference < 0;
    }
    return i < k;
  };
  std::vector<Eigen::Index> sorted(static_cast<std::size_t>(points.rows()));
  std::iota(sorted.begin(), sorted.end(), 0);
  std::ranges::sort(sorted, order);  // equal ones are neighbours: a comparison of all with all takes minutes
  std::optional<std::pair<Eigen::Index, Eigen::Index>> first;
  for (std::size_t at = 1; at < sorted.size(); ++at) {
    const std::pair neighbours{sorted[at - 1], sorted[at]};
    if (points.row(neighbours.first) == points.row(neighbours.second) && (!first || neighbours < *first))
      first = neighbours;
  }
  if (!first) return std::nullopt;
  return Refusal{"duplicated-reading", "points " + std::to_string(first->first + 1) + " and " +
                                           std::to_string(first->second + 1) +
                                           " are equal in every digit: a copied reading is not independent; remove it"};
}

Eigen::VectorXd widthsOf(const Eigen::MatrixXd& points) {
  const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
  const Eigen::MatrixXd scatter = centred.transpose() * centred;
  return symmetricEigenvalues(scatter).cwiseMax(0.0).cwiseSqrt();
}

std::optional<Refusal> pointOff(const Fit& fit, double sigma, std::string_view off_what, std::string_view remedy) {
  Eigen::Index worst = 0;
  const double largest = fit.residuals.cwiseAbs().maxCoeff(&worst) * sigma;
  const double limit = farthestHonest(fit.residuals.size());
  if (largest <= std::max(limit * sigma, kResidualFloor)) return std::nullopt;
  return Refusal{"residual-too-large", "point " + std::to_string(worst + 1) + " lies " + text(largest) + " mm off " +
                                           std::string{off_what} + ", more than " + text(limit) +
                                           " sigma = " + text(limit * sigma) + " mm: " + std::string{remedy}};
}

Residuals pointResiduals(const Fit& fit, double sigma, double sense) {
  Residuals residuals{.unit = "mm", .against = "point", .names = {}, .at = {}, .values = {}};
  for (Eigen::Index k = 0; k < fit.residuals.size(); ++k) {
    residuals.names.push_back("point " + std::to_string(k + 1));
    residuals.at.push_back(static_cast<double>(k + 1));
    residuals.values.push_back(sense * fit.residuals[k] * sigma);
  }
  return residuals;
}

}  // namespace probebox::metrology
