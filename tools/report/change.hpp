#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/report/subject.hpp"
#include "tools/report/svg.hpp"

namespace probebox::report {

// Number of results in a trend, including the newest.
inline constexpr std::size_t kTrend = 10;

// Lines for the head of the page: the largest change against the result in force, in sd of the difference, or that no
// result is in force. Empty if nothing is known of earlier results.
std::vector<std::string> changeLines(const Subject& subject);

// Heads of a table of changes.
struct ChangeHeads {
  std::string title{"Change against the result in force"};
  std::string then{};  // in front of the other result's name
  std::string now{"this"};
};
// Table of scalars and short vectors beside those in force; empty without a result in force.
std::string changeTable(const Subject& subject, const ChangeHeads& heads = {});

// Plots the first short value of the last ten results, minus its newest value, with bars of U; nothing where no earlier
// one has it.
std::optional<Plot> trendPicture(const Subject& subject);

}  // namespace probebox::report
