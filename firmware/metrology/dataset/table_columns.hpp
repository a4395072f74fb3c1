#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Copies named columns of a checked table into a matrix with one row per row.
Eigen::MatrixXd columnsOf(const Table& table, const ColumnNames& names);

}  // namespace probebox::metrology
