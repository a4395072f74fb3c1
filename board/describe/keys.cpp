#include "board/describe/keys.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::board {
namespace {

struct OfUnit {
  std::string_view suffix;
  Range range;
};

// Longest first where one ends with another. What no machine tool, probe or clock has is a slip of the unit or of a
// key.
constexpr std::array kOfUnits{
    OfUnit{"_probability", kProbability},
    OfUnit{"_per_mm", {1e-3, 1e9}},  // counts: a ruler of 1 m to 1 pm
    OfUnit{"_per_deg", {0, 1e9}},    // 0: no encoder
    OfUnit{"_mm_s2", {1, 1e5}},      // 10 g
    OfUnit{"_mm_s", {0, 1e5}},       // 100 m/s
    OfUnit{"_um_s", {0, 1e4}},       // drift of a screw
    OfUnit{"_rad_s", {0, 1000}},     // 160 turns a second
    OfUnit{"_deg_s", {0, 1e6}},
    OfUnit{"_rpm", {0, 1e5}},
    OfUnit{"_ppm", {-1000, 1000}},  // of a clock
    OfUnit{"_hz", {1, 1e6}},        // of samples
    OfUnit{"_rad", {-6.3, 6.3}},    // one turn
    OfUnit{"_deg", {-360, 360}},
    OfUnit{"_ns", {0, 1e9}},
    OfUnit{"_us", {0, 1e6}},
    OfUnit{"_um", {-1e5, 1e5}},  // 0.1 m
    OfUnit{"_mm", kPosition_mm},
    OfUnit{"_s", {-1, 1e6}},  // half a second of lead to twelve days of warming up
};
// Counts, numbers and ratios. Doubles hold every whole number of this size.
constexpr Range kWithoutUnit{-1e15, 1e15};

}  // namespace

Range plausible(std::string_view key) {
  const auto unit = std::ranges::find_if(kOfUnits, [&](const OfUnit& of) { return key.ends_with(of.suffix); });
  return unit == kOfUnits.end() ? kWithoutUnit : unit->range;
}

Range overlap(Range wanted, Range widest) {
  return {std::max(wanted.from, widest.from), std::min(wanted.to, widest.to)};
}

bool contains(Range range, double value) {
  return value >= range.from && value <= range.to;
}

std::string plain(double value) {
  constexpr double kLongest = 1e15, kSmallest = 1e-6;
  const double size = std::abs(value);
  std::array<char, 64> text{};
  if (!std::isfinite(value) || size >= kLongest || (size > 0 && size < kSmallest)) {
    std::snprintf(text.data(), text.size(), "%.6g", value);
    return text.data();
  }
  std::snprintf(text.data(), text.size(), "%.9f", value);
  std::string digits{text.data()};
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.ends_with('.')) digits.pop_back();
  return digits;
}

std::string inWords(Range range) {
  return "from " + plain(range.from) + " to " + plain(range.to);
}

}  // namespace probebox::board
