#pragma once
#include <Eigen/Core>
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// The named columns of a table that checkedTable() has passed, side by side: a row a row.
Eigen::MatrixXd columnsOf(const Table& table, std::span<const std::string_view> names);

}  // namespace probebox::metrology
