#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include "board/describe/ranges.hpp"

// Lists of the keys of a section. A structure that a section describes names them once, in
//   static constexpr void keys(auto& self, auto&& key) { key("late_s", self.late_s, within(0, 0.5), "what it is"); ...
//   }
// and its parser (section.hpp) with all problems that it reports and the table of the keys (docs) follow from that
// list. The type of the member says what is written: a number, a whole number, three of them, a text, true or false,
// one of some names. A key that may be omitted has the member's initial value then; members of optional type may be
// omitted.
namespace probebox::board {

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
