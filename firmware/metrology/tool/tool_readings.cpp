#include "firmware/metrology/tool/tool_readings.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/fit/rounding.hpp"

namespace probebox::metrology {

Outcome<bool, Refusal> anySet(const std::vector<double>& flags, const std::string& column, const char* name) {
  for (std::size_t row = 0; row < flags.size(); ++row) {
    if (flags[row] != 0.0 && flags[row] != 1.0) {
      return Refusal{name, "column '" + column + "', row " + std::to_string(row + 1) + ": must be 0 or 1"};
    }
  }
  return std::ranges::find(flags, 1.0) != flags.end();
}

double roundingOfMeans(const Table& table, std::span<const std::string_view> columns, const Sigma& sigma,
                       Answer& answer) {
  constexpr double kCounts = 0.1;  // of the scatter of a reading
  const auto scatter_mm = answer.readingSd();
  const bool has_sd = !answer.result().estimates.front().sd.empty();
  if (sigma.stated || !scatter_mm || !has_sd) return 0.0;
  double digit_mm = 1.0;  // the finest
  for (const auto column : columns) {
    for (const double value : *table.column(column)) digit_mm = std::min(digit_mm, digitOf(value));
  }
  const double sd_mm = roundingSd(*scatter_mm, digit_mm);
  if (sd_mm > kCounts * *scatter_mm) {
    answer.warn("the readings have digits of " + text(digit_mm) +
                " mm, which hide their noise: what rounding leaves of their mean, " + text(sd_mm) +
                " mm, is in the sd; state sigma_mm, or read more digits");
  }
  return sd_mm;
}

void widen(Result& result, const Eigen::MatrixXd& slopes, const Eigen::VectorXd& sds) {
  const Eigen::MatrixXd scaled = slopes * sds.asDiagonal();
  const Eigen::MatrixXd added = scaled * scaled.transpose();
  Eigen::Index row = 0;
  for (auto& estimate : result.estimates) {
    for (double& sd : estimate.sd) {
      sd = std::hypot(sd, std::sqrt(added(row, row)));
      ++row;
    }
  }
  if (!result.covariance) return;
  const auto entries = added.reshaped<Eigen::RowMajor>();
  for (Eigen::Index k = 0; k < added.size(); ++k) result.covariance->values[static_cast<std::size_t>(k)] += entries[k];
}

Outcome<Fit, Refusal> fitMeans(const Eigen::MatrixX3d& positions, const std::vector<std::size_t>& group,
                               std::size_t groups, double sigma) {
  const Eigen::Index rows = 3 * positions.rows();
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(3 * groups));
  Eigen::VectorXd values{rows};
  for (Eigen::Index k = 0; k < positions.rows(); ++k) {
    const auto column = static_cast<Eigen::Index>(3 * group[static_cast<std::size_t>(k)]);
    design.block<3, 3>(3 * k, column).setIdentity();
    values.segment<3>(3 * k) = positions.row(k).transpose();
  }
  return linearLeastSquares(design / sigma, values / sigma);
}

}  // namespace probebox::metrology
