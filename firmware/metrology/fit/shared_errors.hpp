#pragma once
#include <Eigen/Core>
#include <span>

namespace probebox::metrology {

// Whitens a linear fit whose rows, each with an error of its own of sd 1, also share errors: row i of group g is off by
// moved[i] times one normal variable of g. With t the moves of a group, rows are multiplied by (I + tt')^(-1/2), which
// is symmetric: what is across t stays as it is, and what is along t weighs less. groups: the number of each row's.
void shareErrors(Eigen::MatrixXd& design, Eigen::VectorXd& values, const Eigen::VectorXd& moved,
                 std::span<const double> groups);

}  // namespace probebox::metrology
