#include "firmware/metrology/dataset/dataset.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace probebox::metrology {

Table Table::withColumns(std::string name, const ColumnNames& column_names) {
  Table table{.name = std::move(name), .columns = {}};
  for (const auto column_name : column_names) table.columns.push_back({.name = std::string{column_name}, .values = {}});
  return table;
}

std::size_t Table::rows() const {
  if (columns.empty()) return 0;
  const auto length = [](const Column& column) { return column.values.size(); };
  return length(*std::ranges::min_element(columns, {}, length));
}

bool Table::rectangular() const {
  return std::ranges::all_of(columns, [this](const Column& column) { return column.values.size() == rows(); });
}

const std::vector<double>* Table::column(std::string_view column_name) const {
  const auto found = std::ranges::find(columns, column_name, &Column::name);
  return found == columns.end() ? nullptr : &found->values;
}

void Table::append(std::initializer_list<double> row) {
  assert(row.size() == columns.size());
  auto column = columns.begin();
  for (const double value : row) (column++)->values.push_back(value);
}

const Table* Dataset::table(std::string_view name) const {
  const auto found = std::ranges::find(tables, name, &Table::name);
  return found == tables.end() ? nullptr : &*found;
}

Dataset touchDataset(std::string method) {
  return {.method = std::move(method),
          .config = {},
          .tables = {Table::withColumns("machine", kMachineColumns), Table::withColumns("probe", kProbeColumns),
                     Table::withColumns("touches", kTouchesColumns)}};
}

}  // namespace probebox::metrology
