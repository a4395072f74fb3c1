#include "firmware/metrology/dataset/table_columns.hpp"

namespace probebox::metrology {

Eigen::MatrixXd columnsOf(const Table& table, const ColumnNames& names) {
  Eigen::MatrixXd values{static_cast<Eigen::Index>(table.rows()), static_cast<Eigen::Index>(names.size())};
  for (std::size_t k = 0; k < names.size(); ++k) {
    values.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::VectorXd>{table.column(names[k])->data(), values.rows()};
  }
  return values;
}

}  // namespace probebox::metrology
