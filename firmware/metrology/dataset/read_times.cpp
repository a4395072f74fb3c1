#include "firmware/metrology/dataset/read_times.hpp"

#include <algorithm>
#include <cstddef>

#include "firmware/metrology/dataset/column.hpp"

namespace probebox::metrology {

bool areStamped(const Table& table) {
  const auto* stamps = table.column(column::kReadAt);
  if (stamps == nullptr || stamps->empty()) return false;
  const auto [first, last] = std::ranges::minmax(*stamps);
  return last > first;
}

std::vector<double> readTimes(const Table& table, double each_s) {
  if (areStamped(table)) return *table.column(column::kReadAt);
  std::vector<double> times;
  for (std::size_t row = 0; row < table.rows(); ++row) times.push_back(static_cast<double>(row) * each_s);
  return times;
}

}  // namespace probebox::metrology
