#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/state/kind_of_value.hpp"
#include "protocol/state/shown_when.hpp"
#include "protocol/step/step.hpp"

// When what machine.toml requires is to be measured again.
namespace probebox::published {

enum class DueState : std::uint8_t {
  good = 0,
  overdue = 1,
  not_known = 2,     // such as the age of a result that was measured while the box knew no date
  not_measured = 3,  // nothing about it is in force
};
constexpr std::string_view nameOf(DueState state) {
  return probebox::detail::nameIn({"good", "overdue", "not known", "not measured"}, state);
}
constexpr bool isDue(DueState state) {
  return state == DueState::overdue || state == DueState::not_measured;
}

struct Due {
  std::string name{};  // the subject
  std::uint64_t result_id{};
  DueState state{};
  std::string due_utc{};
  bool has_time{}, has_cutting{}, has_temperature{};
  double remaining_s{}, remaining_cutting_s{}, remaining_temperature_k{};
  static constexpr void fields(auto& self, auto&& field) {
    field("subject", self.name, "as in [[requirement]] of machine.toml", Identifier{});
    field("result_id", self.result_id, "of the result in force; 0: none", Identifier{});
    field("state", self.state, "0 good, 1 overdue, 2 not known, 3 not measured: nothing about it is in force");
    field("due_utc", self.due_utc, "ISO 8601, when its days are over; empty where it has none, or no date is known");
    field("has_time", self.has_time, "1 where remaining_s is known", Identifier{});
    field("has_cutting", self.has_cutting, "1 where remaining_cutting_s is known", Identifier{});
    field("has_temperature", self.has_temperature, "1 where remaining_temperature_k is known", Identifier{});
    field("remaining_s", self.remaining_s, "s, until its days are over, negative behind that",
          NullUnless{self.has_time});
    field("remaining_cutting_s", self.remaining_cutting_s, "s of cutting that remain, negative behind that",
          NullUnless{self.has_cutting});
    field("remaining_temperature_k", self.remaining_temperature_k,
          "K that the temperature may still change by, negative behind that", NullUnless{self.has_temperature});
  }
};

}  // namespace probebox::published
