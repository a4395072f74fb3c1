#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/procedure/facts/facts.hpp"

// The one table of lengths and places that computations use: each is typed in a description, measured, or both.
namespace probebox::procedure {

// Tip of a stylus relative to the spindle's axis, with the spindle at 0.
struct MeasuredStylus {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  std::array<double, 2> at_mm{};
  double sd_mm{};  // the larger of its coordinates, combined (k = 1); 0: unknown
};

// Length of a tool from the gauge line, as an assembly in force has it, and its tip relative to the spindle's axis.
struct MeasuredLength {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  double length_mm{};
  double sd_mm{};  // combined uncertainty (k = 1); 0: unknown
  std::optional<std::array<double, 2>> tip_mm{};
  double sd_tip_mm{};
};

// Tip of a tool relative to the head's reference, as tool-setter has it.
struct MeasuredTip {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  std::array<double, 3> at_mm{};
  std::array<double, 3> sd_mm{};  // combined (k = 1); 0: unknown
};

// Those of the results in force.
struct MeasuredPlaces {
  std::optional<AcceptedValue> ball_x{}, ball_y{};      // of the last check: C from the spindle axis at B = 0
  std::optional<AcceptedValue> ball_y45{}, ball_y90{};  // Y of the former with the head at 45 and 90 degrees
  std::optional<AcceptedValue> ball_x90{}, ball_z90{};  // at 90 degrees, X from ball_x
  std::optional<AcceptedValue> ball_z{};                // centre of the checked ball at C = 0 and B = 0
  std::uint64_t check_result{}, setter_result{};
  std::optional<std::array<double, 3>> setter_mm{};  // at the first B that was read
  bool setter_tells_y{true};                         // false: of a lathe of X and Z, whose Y stays as it is typed
  double sd_setter_mm{};                             // largest of its coordinates, k = 1; 0: not stated
  std::vector<MeasuredStylus> styli{};
  std::optional<std::array<double, 2>> spindle_tilt_rad{};  // of the spindle's axis to X and to Y
  double sd_spindle_tilt_rad{};
  std::uint64_t table_pivot_result{};
  // Of the tilt axis, across it: machine position of the stylus ball. Along it, nothing.
  std::array<std::optional<AcceptedValue>, 3> table_pivot{};
  std::vector<MeasuredLength> tool_lengths{};
  std::vector<MeasuredTip> tool_tips{};
};

// One row of the table.
struct Known {
  std::string by;  // "machine.toml", "result 12"
  double mm{};
  double sd_mm{};  // k = 1; 0: not stated
};
struct PlaceRow {
  std::string name;  // such as "stylus-offset-1 X"; rows of one subject begin with it
  std::optional<Known> typed{};
  std::optional<Known> measured{};  // the newest in force, which is used
  std::optional<Known> other{};     // another measured one of the same quantity, in force beside it

  const Known* used() const { return measured ? &*measured : typed ? &*typed : nullptr; }
};

inline constexpr double kMostApart_sd = 4;

// Puts what is measured in the place of what is typed, and returns the table. kept: a row whose typed value stays.
std::vector<PlaceRow> takeMeasured(Facts& facts, const MeasuredPlaces& measured, std::string_view kept = {});

// Says that two values of a row are more than kMostApart_sd of their combined sd apart; nothing where they are not, or
// where one of them has no stated sd.
std::optional<std::string> disagreement(const PlaceRow& row);

}  // namespace probebox::procedure
