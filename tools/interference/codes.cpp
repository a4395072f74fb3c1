#include "tools/interference/codes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::interference {
namespace {

constexpr double value(Motion motion) {
  return static_cast<double>(motion);
}

// ISO 6983 with what LinuxCNC 2.9, Fanuc 0i to 31i and Haas NGC add.
constexpr std::array kCodes{
    Code{0, Group::motion, Does::motion, value(Motion::rapid), ""},
    Code{10, Group::motion, Does::motion, value(Motion::feed), ""},
    Code{20, Group::motion, Does::motion, value(Motion::clockwise), ""},
    Code{30, Group::motion, Does::motion, value(Motion::counterclockwise), ""},
    Code{382, Group::motion, Does::motion, value(Motion::probe), ""},
    Code{383, Group::motion, Does::motion, value(Motion::probe), ""},
    Code{730, Group::motion, Does::cycle, 73, "PQ"},
    Code{740, Group::motion, Does::cycle, 74, "PQ"},
    Code{760, Group::motion, Does::cycle, 76, "P"},
    Code{800, Group::cycle_off, Does::no_cycle, 0, ""},
    Code{810, Group::motion, Does::cycle, 81, ""},
    Code{820, Group::motion, Does::cycle, 82, "P"},
    Code{830, Group::motion, Does::cycle, 83, "PQ"},
    Code{840, Group::motion, Does::cycle, 84, "PQ"},
    Code{850, Group::motion, Does::cycle, 85, "P"},
    Code{860, Group::motion, Does::cycle, 86, "P"},
    Code{890, Group::motion, Does::cycle, 89, "P"},
    Code{40, Group::once, Does::dwell, 0, ""},
    Code{100, Group::once, Does::set_zero, 0, ""},
    Code{280, Group::once, Does::home, 0, ""},
    Code{300, Group::once, Does::home, 0, "P"},
    Code{310, Group::once, Does::probe, 0, ""},
    Code{520, Group::once, Does::shift, 0, ""},
    Code{530, Group::once, Does::machine, 0, ""},
    Code{920, Group::once, Does::set_place, 0, ""},
    Code{921, Group::once, Does::unset_place, 0, ""},
    Code{170, Group::plane, Does::plane, 2, ""},
    Code{180, Group::plane, Does::plane, 1, ""},
    Code{190, Group::plane, Does::plane, 0, ""},
    Code{200, Group::unit, Does::unit, 25.4, ""},
    Code{210, Group::unit, Does::unit, 1, ""},
    Code{900, Group::distance, Does::distance, 0, ""},
    Code{910, Group::distance, Does::distance, 1, ""},
    Code{901, Group::arc_middle, Does::arc_middle, 1, ""},
    Code{911, Group::arc_middle, Does::arc_middle, 0, ""},
    Code{430, Group::length, Does::length_on, 0, ""},
    Code{490, Group::length, Does::length_off, 0, ""},
    Code{540, Group::zero, Does::zero, 1, ""},
    Code{550, Group::zero, Does::zero, 2, ""},
    Code{560, Group::zero, Does::zero, 3, ""},
    Code{570, Group::zero, Does::zero, 4, ""},
    Code{580, Group::zero, Does::zero, 5, ""},
    Code{590, Group::zero, Does::zero, 6, ""},
    Code{980, Group::cycle_end, Does::cycle_end, 0, ""},
    Code{990, Group::cycle_end, Does::cycle_end, 1, ""},
    // Feeds, spindle, accuracy, and what cancels a transformation.
    Code{50, Group::quiet, Does::nothing, 0, "P"},
    Code{51, Group::quiet, Does::nothing, 0, "QR"},
    Code{80, Group::quiet, Does::nothing, 0, "P"},
    Code{90, Group::quiet, Does::nothing, 0, ""},
    Code{131, Group::quiet, Does::nothing, 0, ""},
    Code{150, Group::quiet, Does::nothing, 0, ""},
    Code{230, Group::quiet, Does::nothing, 0, ""},
    Code{400, Group::quiet, Does::nothing, 0, ""},
    Code{401, Group::quiet, Does::nothing, 0, ""},
    Code{500, Group::quiet, Does::nothing, 0, ""},
    Code{501, Group::quiet, Does::nothing, 0, "XYZ"},
    Code{610, Group::quiet, Does::nothing, 0, ""},
    Code{611, Group::quiet, Does::nothing, 0, ""},
    Code{640, Group::quiet, Does::nothing, 0, "PQ"},
    Code{670, Group::quiet, Does::nothing, 0, ""},
    Code{690, Group::quiet, Does::nothing, 0, ""},
    Code{930, Group::quiet, Does::nothing, 0, ""},
    Code{940, Group::quiet, Does::nothing, 0, ""},
    Code{950, Group::quiet, Does::nothing, 0, ""},
    Code{970, Group::quiet, Does::nothing, 0, ""},
    Code{1030, Group::quiet, Does::nothing, 0, "P"},
    Code{1870, Group::quiet, Does::nothing, 0, "PE"},
};

// Of a 840D, which has these in place of G20, G21 and others.
constexpr std::array kSiemens{
    Code{600, Group::quiet, Does::nothing, 0, ""}, Code{700, Group::unit, Does::unit, 25.4, ""},
    Code{7000, Group::unit, Does::unit, 25.4, ""}, Code{710, Group::unit, Does::unit, 1, ""},
    Code{7100, Group::unit, Does::unit, 1, ""},
};

struct Unfollowed {
  int tenths;
  const char* why;
};

constexpr const char* kRadius = "moves the tool beside the path by a radius of the control: write out the tool's path";
constexpr const char* kTip = "is control of the tip under rotary axes, which is not followed: write out linear axes";
constexpr const char* kTransformed = "transforms the coordinates: write the path out in G54";
constexpr const char* kLength = "takes another length than G43 with H: write G43";
constexpr const char* kZero =
    "chooses a zero that the cell does not state: program_zero_mm is that of one of G54 to G59";

constexpr std::array kUnfollowed{
    Unfollowed{410, kRadius},       Unfollowed{420, kRadius},      Unfollowed{411, kRadius},
    Unfollowed{421, kRadius},       Unfollowed{434, kTip},         Unfollowed{435, kTip},
    Unfollowed{2340, kTip},         Unfollowed{160, kTransformed}, Unfollowed{510, kTransformed},
    Unfollowed{511, kTransformed},  Unfollowed{680, kTransformed}, Unfollowed{682, kTransformed},
    Unfollowed{1010, kTransformed}, Unfollowed{431, kLength},      Unfollowed{432, kLength},
    Unfollowed{440, kLength},       Unfollowed{541, kZero},        Unfollowed{591, kZero},
    Unfollowed{592, kZero},         Unfollowed{1540, kZero},       Unfollowed{121, kTransformed},
    Unfollowed{593, kZero},
};

// Beginning with G or M, as it is written.
std::string written(char letter, double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%c%.10g", letter, number);
  return text.data();
}

}  // namespace

Outcome<Code, Refusal> codeOf(double g, bool siemens, std::size_t line) {
  const int tenths = static_cast<int>(std::lround(g * 10));
  if (std::abs(g * 10 - tenths) < 1e-6) {
    const auto row = std::ranges::find(kCodes, tenths, &Code::tenths);
    if (row != kCodes.end()) return *row;
    const auto other = std::ranges::find(kSiemens, tenths, &Code::tenths);
    if (siemens && other != kSiemens.end()) return *other;
    const auto known = std::ranges::find(kUnfollowed, tenths, &Unfollowed::tenths);
    if (known != kUnfollowed.end()) return Refusal{"code-not-followed", line, written('G', g) + " " + known->why};
  }
  return Refusal{"unknown-code", line, written('G', g) + " is not understood: write the path with G0 to G3"};
}

Outcome<std::string_view, Refusal> wordsOfM(double m, std::size_t line) {
  constexpr std::array kCalls{17.0, 96.0, 97.0, 98.0, 99.0, 198.0};
  if (std::ranges::find(kCalls, m) != kCalls.end())
    return Refusal{"other-program", line, written('M', m) + " goes on in another program: write its blocks out here"};
  if (m != std::floor(m) || m < 0 || (m >= 70 && m <= 73))
    return Refusal{"unknown-code", line, written('M', m) + " may change how the program is read: remove it"};
  if (m == 19) return std::string_view{"RPQ"};
  if (m >= 48 && m <= 53) return std::string_view{"P"};
  if (m >= 62 && m <= 68) return std::string_view{"PQEL"};
  if (m >= 100) return std::string_view{"PQ"};
  return std::string_view{};
}

}  // namespace probebox::interference
