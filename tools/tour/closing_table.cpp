#include "tools/tour/closing_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "tools/case/readable.hpp"

namespace probebox::tour {

void ClosingTable::estimate(const std::string& what, const messages::NamedValue& found, double truth) {
  constexpr double kMostSd = 4;
  const auto u = found.uncertainty();
  const bool judged = u && *u > 0;
  const double distance = judged ? std::abs(found.value - truth) / *u : HUGE_VAL;
  const auto label = casefolder::labelOf(found.key);
  std::array<char, 64> off{};
  std::snprintf(off.data(), off.size(), "; off by %.1f u", distance);
  rows_.push_back({what, casefolder::withUncertainty(label, found.value, judged ? u : std::nullopt),
                   "truth " + casefolder::withUncertainty(label, truth, std::nullopt) + off.data(),
                   distance <= kMostSd});
}

void ClosingTable::exact(const std::string& what, const std::string& found, bool right) {
  rows_.push_back({what, found, "exact", right});
}

bool ClosingTable::allRight() const {
  return !rows_.empty() && std::all_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.right; });
}

void ClosingTable::print() const {
  int what_width = 0;
  int found_width = 0;
  for (const Row& row : rows_) {
    what_width = std::max(what_width, static_cast<int>(row.what.size()));
    found_width = std::max(found_width, static_cast<int>(row.found.size()));
  }
  for (const Row& row : rows_) {
    std::printf("  %-5s  %-*s  %-*s  %s\n", row.right ? "ok" : "WRONG", what_width, row.what.c_str(), found_width,
                row.found.c_str(), row.expected.c_str());
  }
}

}  // namespace probebox::tour
