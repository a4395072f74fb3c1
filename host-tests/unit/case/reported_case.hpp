#pragma once
#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {

// One case of every method, whose answer the report's tests show.
inline std::vector<std::string> caseNames() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator{PROBEBOX_REPORT_CASES})
    names.push_back(entry.path().filename());
  std::ranges::sort(names);
  return names;
}

inline metrology::Dataset reportedCase(const std::string& name) {
  return readCase(std::filesystem::path{PROBEBOX_REPORT_CASES} / name).value();
}

// A case with one column of one table changed.
inline metrology::Dataset changed(const std::string& name, const std::string& table, const std::string& what,
                                  const std::function<void(double&)>& change) {
  auto dataset = reportedCase(name);
  for (auto& each : dataset.tables) {
    for (auto& column : each.columns)
      if (each.name == table && column.name == what) std::ranges::for_each(column.values, change);
  }
  return dataset;
}

}  // namespace probebox::casefolder
