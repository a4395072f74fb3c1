#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// The name of their line in the budget.
inline constexpr std::string_view kStampDigitsBudget = "digits of t_s";

// The coarsest decimal place of 1 us to 1 s of which all times are multiples; 0 where they show finer ones.
double digitOfTimes(const std::vector<double>& times_s);

// Stamps of a table that end in a place above 1 us, or come in ticks of a clock that are longer. Rounding moves the
// stamps of a stream that has a steady rate all alike, so neither its residuals nor its intervals show what it does to
// a delay.
struct CoarseStamps {
  std::string table;
  double digit_s{};
  bool ticks{};  // no decimal place: of 1/1024 s
  double sd_s() const;
};

// Those of the streams that are compared, tables machine, probe and article, where none shows finer places: then the
// other begins at a round time and has an even rate.
std::vector<CoarseStamps> coarseStamps(const Dataset& dataset);

// One sentence for each.
std::string sentenceOf(const CoarseStamps& stamps);

}  // namespace probebox::metrology
