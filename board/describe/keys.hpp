#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

// Lists of the keys of a section, and what the keys of all descriptions have in common: ranges by their units. A
// structure that a section describes names its plain keys once, in
//   static constexpr void keys(auto& self, auto&& key) { key("late_s", self.late_s, within(0, 0.5), "what it is"); }
// and KeyReader (section.hpp) reads and checks them by that list. The type of the member says what is written: a
// number, a whole number, three of them, a text, true or false, one of some names. A key that may be omitted has the
// member's initial value then; members of optional type may always be omitted.
namespace probebox::board {

struct Range {
  double from{};
  double to{};
};
inline constexpr Range kProbability{0, 1};
inline constexpr Range kPosition_mm{-50'000, 50'000};  // the largest gantries are shorter than 50 m
inline constexpr Range kDuration_s{0, 3600};
inline constexpr Range kToolNumbers{1, 65'535};

// Between two plates, or in a bore, beside the stylus ball: the least clearance of a touch and the run-out of its
// retract.
inline constexpr double kLeastGapRoom_mm = 1.6;

// Returns the widest range of a value by the unit at the end of its key: "travel_min_mm" is a length in mm. Always
// finite. Ranges that readers ask for are limited to it.
Range plausible(std::string_view key);

// Returns the intersection; `wanted` lies inside `widest` except at its ends.
Range overlap(Range wanted, Range widest);

// False for NaN and for the infinities too.
bool contains(Range range, double value);

// Formats a number as a person writes it: "10000000", "0.00001", "1e+308".
std::string plain(double value);
// "from 0.1 to 1000"
std::string inWords(Range range);

struct Key {
  Range range{-1e15, 1e15};
  bool may_be_omitted{};
  double factor{1};     // of the member over the number in the file
  std::size_t most{1};  // elements of a list, from 1

  constexpr Key orUsual() const { return {range, true, factor, most}; }
  constexpr Key times(double of_the_member) const { return {range, may_be_omitted, of_the_member, most}; }
  constexpr Key upTo(std::size_t elements) const { return {range, may_be_omitted, factor, elements}; }
};

constexpr Key within(double from, double to) {
  return {{from, to}};
}
constexpr Key within(Range range) {
  return {range};
}
inline constexpr Key kAnyText{};

// The names of an enumeration, in the order of its values.
template <std::size_t N>
struct OneOf {
  std::array<const char*, N> names;
  bool may_be_omitted{};

  constexpr OneOf orUsual() const { return {names, true}; }
};
template <class... Names>
constexpr OneOf<sizeof...(Names)> oneOf(Names... names) {
  return {{names...}};
}

}  // namespace probebox::board
