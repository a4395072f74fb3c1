#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/report/subject.hpp"
#include "tools/report/svg.hpp"

namespace probebox::report {

// Results in a trend, the newest included.
inline constexpr std::size_t kTrend = 10;

// For the head of the page: the largest change against the result in force, in sd of the difference, or that there is
// none in force. Empty where nothing is known of earlier results.
std::vector<std::string> changeLines(const Subject& subject);

// Every short value beside the one in force; empty without one.
std::string changeTable(const Subject& subject);

// The first short value in the last ten results, minus its newest value, with bars of U; nothing without history.
std::optional<Plot> trendPicture(const Subject& subject);

}  // namespace probebox::report
