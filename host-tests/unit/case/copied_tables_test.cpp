// Copies make every sd too small. A case whose tables hold everything twice is refused, says so, or has the same sd.
#include <algorithm>
#include <filesystem>
#include <gmock/gmock.h>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using metrology::Dataset;
using metrology::Result;
using metrology::Table;

void twice(Table& table, std::string_view number = {}) {
  constexpr double kNumbers = 1000;  // beyond those in use
  for (auto& column : table.columns) {
    const auto once = column.values;
    for (const double value : once) column.values.push_back(column.name == number ? value + kNumbers : value);
  }
}

// Whether no promised value has a smaller sd than before.
bool hasTheSd(const Result& answer, const Result& good) {
  constexpr double kSame = 0.98;
  return std::ranges::all_of(good.estimates, [&](const auto& before) {
    const auto* after = answer.find(before.key);
    if (after == nullptr) return false;
    const auto count = std::min(before.sd.size(), after->sd.size());
    for (std::size_t k = 0; k < count; ++k)
      if (after->sd[k] < kSame * before.sd[k]) return false;
    return true;
  });
}

void expectTold(const Dataset& dataset, const Result& good, const std::string& copied) {
  const auto solved = metrology::solve(dataset);
  if (!solved || solved->warnings != good.warnings || hasTheSd(*solved, good)) return;
  ADD_FAILURE() << dataset.method << ": " << copied << " twice makes the sd smaller without a word";
}

TEST(CopiedTables, AreToldOrLeaveTheSdAsItIs) {
  std::set<std::string> without_sd;
  for (const auto& entry : fs::directory_iterator{PROBEBOX_REPORT_CASES}) {
    auto dataset = readCase(entry.path()).value();
    if (dataset.method == "c-zero-shift") dataset.config["sigma_C_rad"] = 1e-5;  // one pair tells no sd
    const auto good = metrology::solve(dataset).value();
    if (good.estimates.front().sd.empty()) without_sd.insert(dataset.method);
    for (std::size_t k = 0; k < dataset.tables.size(); ++k) {
      auto copied = dataset;
      twice(copied.tables[k]);
      expectTold(copied, good, "table " + copied.tables[k].name);
    }
    for (const std::string_view number : {"touch", "scan"}) {
      auto copied = dataset;
      for (auto& table : copied.tables)
        if (table.column(number) != nullptr) twice(table, number);
      expectTold(copied, good, "every " + std::string{number} + " under a number of its own");
    }
  }
  EXPECT_THAT(without_sd, testing::SizeIs(testing::Le(3U))) << testing::PrintToString(without_sd);
}

}  // namespace
}  // namespace probebox::casefolder
