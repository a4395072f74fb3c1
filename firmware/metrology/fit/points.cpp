#include "firmware/metrology/fit/points.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

constexpr double kResidualFloor = 1e-6;  // mm; what the digits of a case file may round away

}  // namespace

Rows3 pointRows(const Table& table) {
  constexpr std::array<std::string_view, 3> kCoordinates{"x_mm", "y_mm", "z_mm"};
  return columnsOf(table, kCoordinates);
}

std::optional<Refusal> equalPoints(const Eigen::MatrixXd& points) {
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    for (Eigen::Index k = i + 1; k < points.rows(); ++k) {
      if (points.row(i) == points.row(k)) {
        return Refusal{"duplicated-reading",
                       "points " + std::to_string(i + 1) + " and " + std::to_string(k + 1) +
                           " are equal in every digit: a copied reading is not independent; remove it"};
      }
    }
  }
  return std::nullopt;
}

Eigen::VectorXd widthsOf(const Eigen::MatrixXd& points) {
  const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
  const Eigen::MatrixXd scatter = centred.transpose() * centred;
  return symmetricEigenvalues(scatter).cwiseMax(0.0).cwiseSqrt();
}

std::optional<Refusal> pointOff(const Fit& fit, double sigma, std::string_view off_what, std::string_view remedy) {
  Eigen::Index worst = 0;
  const double largest = fit.residuals.cwiseAbs().maxCoeff(&worst) * sigma;
  if (largest <= std::max(4.0 * sigma, kResidualFloor)) return std::nullopt;
  return Refusal{"residual-too-large", "point " + std::to_string(worst + 1) + " lies " + text(largest) + " mm off " +
                                           std::string{off_what} + ", more than 4 sigma = " + text(4.0 * sigma) +
                                           " mm: " + std::string{remedy}};
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
