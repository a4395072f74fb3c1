#include "tools/tour/closing_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::tour {

void ClosingTable::estimate(const std::string& what, const std::string& unit, double scale, double value, double sd,
                            double truth) {
  constexpr double kMostSd = 4;
  const double distance = sd > 0 ? std::abs(value - truth) / sd : HUGE_VAL;
  std::array<char, 128> found{};
  std::array<char, 128> expected{};
  std::snprintf(found.data(), found.size(), "%.4f +- %.4f %s", value * scale, sd * scale, unit.c_str());
  std::snprintf(expected.data(), expected.size(), "%.4f %s, off by %.1f sd", truth * scale, unit.c_str(), distance);
  rows_.push_back({what, found.data(), expected.data(), distance <= kMostSd});
}

void ClosingTable::exact(const std::string& what, const std::string& found, bool right) {
  rows_.push_back({what, found, "exact", right});
}

bool ClosingTable::allRight() const {
  return !rows_.empty() && std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.right; });
}

void ClosingTable::print() const {
  for (const Row& row : rows_) {
    std::printf("  %-5s %-26s %-32s %s\n", row.right ? "ok" : "WRONG", row.what.c_str(), row.found.c_str(),
                row.expected.c_str());
  }
}

}  // namespace probebox::tour
