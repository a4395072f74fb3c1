#pragma once
#include <string_view>

namespace probebox::metrology {

// Table "readings_by_pre_travel_2" holds the changes of the columns of table "readings" by one sd (k = 1) of cause 2 of
// the uncertainty of a probe's pre-travel. The causes are numbered from 1 and are uncorrelated.
inline constexpr std::string_view kByPreTravel = "_by_pre_travel_";
inline constexpr std::string_view kPreTravelBudget = "sd_pre_travel_mm";  // their line of the budget

}  // namespace probebox::metrology
