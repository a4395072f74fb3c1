#include "firmware/metrology/tool/tool_readings.hpp"

#include <algorithm>

namespace probebox::metrology {

Outcome<bool, Refusal> anySet(const std::vector<double>& flags, std::string_view column, const char* name) {
  for (std::size_t row = 0; row < flags.size(); ++row) {
    if (flags[row] != 0.0 && flags[row] != 1.0) {
      return Refusal{name, "column '" + std::string{column} + "', row " + std::to_string(row + 1) + ": must be 0 or 1"};
    }
  }
  return std::ranges::find(flags, 1.0) != flags.end();
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
