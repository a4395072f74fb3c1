#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::casefolder {

// One table from the text of NAME.csv: a line of column names, then rows of as many finite numbers, every line ended.
// Every problem is told, by file, line and column.
Outcome<metrology::Table, std::vector<metrology::Refusal>> parseCsv(std::string_view text,
                                                                    const std::string& table_name);

// The text that parseCsv turns back into the same doubles.
std::string formatCsv(const metrology::Table& table);

}  // namespace probebox::casefolder
