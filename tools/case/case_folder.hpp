#pragma once
#include <filesystem>
#include <string>
#include <variant>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::casefolder {

// No case: the folder or its config.json is missing, is not JSON, or names no method. Exit status 2.
struct Unreadable {
  std::string reason;
};

// A case whose content cannot support an answer. Exit status 1. The method is known by then.
struct Unsupported {
  std::string method;
  metrology::Refusal refusal;
};

using Problem = std::variant<Unreadable, Unsupported>;

// Reads config.json and every *.csv beside it; table machine.csv becomes table "machine". Nothing else is opened.
// A CSV has one line of column names, then rows of as many numbers, every line ended by a line feed (CR LF will do).
// Every problem of the folder is told, one a line; the refusal has the name of the first. They name file, line and
// column: bad-config, empty-file, bad-header, truncated-row, extra-cells, not-a-number,
// not-finite, truncated-file (the last line has no end).
Outcome<metrology::Dataset, Problem> readCase(const std::filesystem::path& folder);

// Writes the folder, which may exist if it holds no config.json yet. Numbers have the shortest digits that read back as
// the same double, so that solving the folder gives the digits of solving the dataset.
Outcome<std::filesystem::path> writeCase(const metrology::Dataset& dataset, const std::filesystem::path& folder);

}  // namespace probebox::casefolder
