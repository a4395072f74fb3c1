#include "firmware/metrology/fit/shared_errors.hpp"

#include <cmath>
#include <map>
#include <vector>

namespace probebox::metrology {

void shareErrors(Eigen::MatrixXd& design, Eigen::VectorXd& values, const Eigen::VectorXd& moved,
                 std::span<const double> groups) {
  std::map<double, std::vector<Eigen::Index>> rows_of;
  for (std::size_t row = 0; row < groups.size(); ++row) rows_of[groups[row]].push_back(static_cast<Eigen::Index>(row));
  for (const auto& [group, rows] : rows_of) {
    const Eigen::VectorXd moves = moved(rows);
    const double square = moves.squaredNorm();
    if (square == 0) continue;
    const Eigen::VectorXd less = (1.0 - 1.0 / std::sqrt(1.0 + square)) / square * moves;
    const Eigen::MatrixXd of_group = design(rows, Eigen::all);
    design(rows, Eigen::all) -= less * (moves.transpose() * of_group);
    const double along = moves.dot(values(rows));
    values(rows) -= along * less;
  }
}

}  // namespace probebox::metrology
