#pragma once
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

// When the readings of a case were taken, by which a drift counts.
namespace probebox::metrology {

// Key of a case: duration from one reading to the next, in seconds.
inline constexpr std::string_view kReadingTime = "time_per_reading_s";

// True of a table whose rows have stamps that are not all the same.
bool areStamped(const Table& table);

// When each row was read, in seconds: its stamp, or by the order of the rows, each_s apart from 0 on.
std::vector<double> readTimes(const Table& table, double each_s);

}  // namespace probebox::metrology
