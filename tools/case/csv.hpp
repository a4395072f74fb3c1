#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::casefolder {

// Reads a table from the text of NAME.csv: a line of column names, then rows of as many finite numbers, each line with
// its end. Reads what spreadsheets and numpy make of it: UTF-16, a byte order mark, lines ended by CR, `sep=,`,
// comments before the names or about them, quotes about a cell, `+1.25`, a typographic minus, empty columns at the end.
// Reports every problem with file, line and column.
Outcome<metrology::Table, std::vector<metrology::Refusal>> parseCsv(std::string_view text,
                                                                    const std::string& table_name);

// Writes the text that parseCsv reads back as the same doubles.
std::string formatCsv(const metrology::Table& table);

}  // namespace probebox::casefolder
