#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware/tape/text.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Parser of the lines of text that a control prints, for example by DPRNT.
namespace probebox::tape {

// A line that was not understood. `name` is stable.
struct Refused {
  std::string name;
  std::string what;
};

// Positions as the control shows them, mm.
struct Positions {
  std::array<std::optional<double>, 3> at_mm{};
};

// Markers have no run: whoever takes them gives them the present one. Stamps are the receiver's.
using Said = std::vector<Event>;
using Report = std::variant<Ask, Said, Positions>;

// Understands one line. Spaces and asterisks do not count, nor does the case:
//   BEGIN3 A0. B0. C90. T1 F15.   END3 ..   ABANDON3 ..   a step, from 0; deg, tool, measuring speed in mm/s
//   HOME X120.5 Z0.               machine positions of axes at standstill, mm
//   POSE B30. T4 L120.            angles, deg; tool and its length, mm
//   CUT1   CUT0                   a cut begins, or is over
//   X12.3 Y4.5 Z6.7               positions or a probing result, mm
//   STATUS   CORRECTIONS   CENTRELINE   DELAY   ALL
Outcome<Report, Refused> understood(std::string_view line);

}  // namespace probebox::tape
