#pragma once
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::command {

// Columns of whole numbers; `names` and `columns` have the same order.
struct IntegerTable {
  std::vector<std::string> names;
  std::vector<std::vector<std::int64_t>> columns;
};

// Reads a line of column names, then lines of as many whole numbers of 64 bits, separated by commas; a line may end as
// on Windows. `progress` is told now and then how many bytes were read. Errors name line and column.
Outcome<IntegerTable> readIntegerTable(std::istream& in, const std::function<void(std::uint64_t)>& progress = {});

}  // namespace probebox::command
