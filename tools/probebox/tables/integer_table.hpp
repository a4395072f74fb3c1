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

// Reads a line of column names, then lines of as many 64-bit integers, separated by commas; all lines end with LF or CR
// LF. A byte order mark is skipped.
// `progress` is called now and then with the number of bytes read. Errors name line and column.
Outcome<IntegerTable> readIntegerTable(std::istream& in, const std::function<void(std::uint64_t)>& progress = {});

}  // namespace probebox::command
