#include "firmware/metrology/dataset/stamp_ticks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace probebox::metrology {
namespace {

constexpr double kShortestTick_s = 1.5e-6;
constexpr double kTicksByChance = 1e-4;
constexpr std::size_t kFewestUneven = 3;  // a steady stream may pause, for any number of its controller's cycles

// What the digits of a file leave of a stamp: half of its last place.
double roundingOf(const std::vector<double>& times_s) {
  constexpr double kOfNumber = 5e-10;  // ten digits
  double place_s = 1e-6, last_s = 0;
  for (const double time_s : times_s) {
    last_s = std::max(last_s, std::abs(time_s));
    while (place_s > 1.5e-9 && std::abs(std::remainder(time_s, place_s)) > 1e-3 * place_s) place_s /= 10;
  }
  return 0.6 * place_s + kOfNumber * last_s;
}

// A stream as lengths of time, each list ascending.
struct Lengths {
  std::vector<double> intervals_s;  // between samples that follow each other in a touch
  std::vector<double> within_s;     // of samples from the first of their touch
  std::vector<double> starts_s;     // of touches from the first of the table
};

Lengths lengthsOf(const Table& table, const std::vector<double>& times_s) {
  const auto* touches =
      table.column(column::kTouch) != nullptr ? table.column(column::kTouch) : table.column(column::kScan);
  Lengths lengths;
  double first_s = times_s.front();
  for (std::size_t row = 1; row < times_s.size(); ++row) {
    if (touches != nullptr && (*touches)[row] != (*touches)[row - 1]) {
      first_s = times_s[row];
      lengths.starts_s.push_back(std::abs(first_s - times_s.front()));
    } else if (times_s[row] > times_s[row - 1]) {
      lengths.intervals_s.push_back(times_s[row] - times_s[row - 1]);
      lengths.within_s.push_back(times_s[row] - first_s);
    }
  }
  std::ranges::sort(lengths.intervals_s);
  std::ranges::sort(lengths.within_s);
  std::ranges::sort(lengths.starts_s);
  return lengths;
}

// Searches the longest tick of which all lengths are multiples.
class CommonTick {
 public:
  // The tick is a part of the shortest interval.
  CommonTick(double shortest_s, double rounding_s)
      : shortest_s_{shortest_s},
        rounding_s_{rounding_s},
        least_s_{std::max(kShortestTick_s, 50 * rounding_s)},
        tick_s_{shortest_s} {}

  // 0 where there is none.
  double tick_s() const { return tick_s_ < least_s_ ? 0 : tick_s_; }
  double inShortest() const { return std::round(shortest_s_ / tick_s_); }

  // Makes the tick smaller until it measures the lengths as well.
  void measure(const std::vector<double>& lengths_s) {
    for (const double length_s : lengths_s) {
      const double unknown_s = 2 * rounding_s_ + unknownOf(length_s / tick_s_);
      if (unknown_s > tick_s_ / 8 || tick_s_ < least_s_) return;
      const double off_s = std::abs(std::remainder(length_s, tick_s_));
      if (off_s > unknown_s) divide(off_s, unknown_s);
    }
  }

  // Takes the tick from lengths that are many of it; there is none where they are no multiples.
  void agree(const std::vector<double>& lengths_s) {
    double products_s = 0, squares = 0;
    for (const double length_s : lengths_s) {
      const double ticks = std::round(length_s / tick_s_), unknown_s = 2 * rounding_s_ + unknownOf(ticks);
      if (tick_s_ < least_s_ || unknown_s > tick_s_ / 8) return;
      if (std::abs(length_s - ticks * tick_s_) > unknown_s) tick_s_ = 0;
      products_s += length_s * ticks;
      squares += ticks * ticks;
      if (ticks / 2 <= known_by_ || tick_s_ == 0) continue;
      known_by_ = ticks / 2;
      tick_s_ = products_s / squares;
    }
  }

  // Whether a steady rate was put on the ticks: by intervals that are no multiples of the shortest, as where samples
  // are lost, and that no chance makes multiples of the tick.
  bool isShownBy(const std::vector<double>& intervals_s) const {
    double chance = inShortest() * inShortest();  // among so many parts of an interval one fits some length
    std::size_t uneven = 0;
    for (const double interval_s : intervals_s) {
      if (std::abs(std::remainder(interval_s, shortest_s_)) < tick_s_ / 2) continue;
      ++uneven;
      const double unknown_s = 2 * rounding_s_ + unknownOf(interval_s / tick_s_);
      chance *= std::min(1.0, 2 * unknown_s / tick_s_);
    }
    return inShortest() > 1 && uneven >= kFewestUneven && chance < kTicksByChance;
  }

 private:
  // By Euclid's algorithm, whose remainders are less and less known.
  void divide(double other_s, double other_unknown_s) {
    double unknown_s = unknownOf(1);
    while (other_s > other_unknown_s && other_unknown_s < tick_s_ / 8) {
      const double times = std::round(tick_s_ / other_s);
      const double rest_s = std::abs(tick_s_ - times * other_s), rest_unknown_s = unknown_s + times * other_unknown_s;
      tick_s_ = std::exchange(other_s, rest_s);
      unknown_s = std::exchange(other_unknown_s, rest_unknown_s);
    }
    tick_s_ = shortest_s_ / inShortest();
    known_by_ = inShortest() / 2;
  }
  // What the error of the tick makes of so many.
  double unknownOf(double ticks) const { return rounding_s_ * ticks / known_by_; }

  double shortest_s_;
  double rounding_s_;
  double least_s_;
  double tick_s_;
  double known_by_{0.5};  // the tick is known to the rounding by this number
};

}  // namespace

StampTicks ticksOf(const Table& table) {
  const auto* times_s = table.column(column::kTime);
  if (times_s == nullptr || times_s->empty()) return {};
  // A table whose columns differ in length is refused by its method.
  const auto is_whole = [&](const Column& column) { return column.values.size() == times_s->size(); };
  if (!std::ranges::all_of(table.columns, is_whole)) return {};
  const auto [intervals_s, within_s, starts_s] = lengthsOf(table, *times_s);
  if (intervals_s.empty()) return {};
  CommonTick common{intervals_s.front(), roundingOf(*times_s)};
  common.measure(intervals_s);
  common.agree(within_s);
  common.measure(starts_s);
  common.agree(within_s);
  common.agree(starts_s);
  if (common.tick_s() == 0) return {};
  return {.tick_s = common.tick_s(), .shown = common.isShownBy(intervals_s)};
}

}  // namespace probebox::metrology
