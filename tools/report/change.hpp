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

// Table of scalars and short vectors beside those in force; empty without a result in force.
std::string changeTable(const Subject& subject);

// Plots the first short value of the last ten results, minus its newest value, with bars of U; nothing where no earlier
// one has it.
std::optional<Plot> trendPicture(const Subject& subject);

}  // namespace probebox::report
