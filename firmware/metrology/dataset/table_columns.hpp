#pragma once
#include <Eigen/Core>
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Copies named columns of a checked table into a matrix with one row per row.
Eigen::MatrixXd columnsOf(const Table& table, std::span<const std::string_view> names);

}  // namespace probebox::metrology
