#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::casefolder {

// Not a case: the folder or its config.json is missing, is not JSON, or names no method. Exit status 2.
struct Unreadable {
  std::string reason;
};

// A case of a known method whose content cannot be solved. Exit status 1.
struct Unsupported {
  std::string method;
  metrology::Refusal refusal;
};

using Problem = std::variant<Unreadable, Unsupported>;

// Reads config.json and every *.csv beside it, nothing else; machine.csv becomes table "machine".
// A CSV has one line of column names, then rows of as many numbers; every line ends with LF or CR LF.
// Reports every problem of the folder, one per line, with file, line and column; the refusal has the name of the first:
// bad-config, empty-file, bad-header, truncated-row, extra-cells, not-a-number, not-finite, truncated-file (the last
// line has no end).
Outcome<metrology::Dataset, Problem> readCase(const std::filesystem::path& folder);

// Explains why writeCase() could not write into the folder, by a trial that leaves no trace.
std::optional<Error> whyNoPlaceForCase(const std::filesystem::path& folder);

// Writes the folder, which may exist if it holds no config.json and no *.csv. Numbers have the shortest digits that
// read back as the same double, so solving the folder gives the same digits as solving the dataset.
Outcome<std::filesystem::path> writeCase(const metrology::Dataset& dataset, const std::filesystem::path& folder);

}  // namespace probebox::casefolder
