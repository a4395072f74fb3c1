#pragma once
#include <array>
#include <string_view>

namespace probebox::metrology {

// An axis that stood still in a run: what its stop is off is common to all readings and not in their residuals. Table
// "readings_by_stop_of_table" holds the changes of the columns of table "readings" by one sd (k = 1) of that stop, row
// by row, or in one row for all of them. Where the axis stood at several stops, column `of_stop` of that table numbers
// them: rows of one number share its error, others have their own. It is part of the sd of every value, and of the
// covariance, and a line of the budget.
struct StandingAxis {
  std::string_view suffix;  // of the table
  std::string_view budget;  // name of the line
};
inline constexpr StandingAxis kTableStands{"_by_stop_of_table", "stop_of_table"};
inline constexpr StandingAxis kHeadStands{"_by_stop_of_head", "stop_of_head"};
inline constexpr std::string_view kOfStop{"of_stop"};
inline constexpr std::array kStandingAxes{kTableStands, kHeadStands};

}  // namespace probebox::metrology
