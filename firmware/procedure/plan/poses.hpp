#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/procedure/plan/method_table.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"

// Where the rotary axes stand for each reading of a method, and which sides of the feature can be touched there.
namespace probebox::procedure {

// The options of a run with the method's usual values in the place of zeros. Points into row and options.
struct Chosen {
  std::span<const double> speeds_mm_s;
  double overtravel_mm{};
  double clearance_mm{};
  double approach_rad{};
  double arc_rad{};
  std::uint16_t angles{};
  std::uint16_t balls{};
  std::uint32_t tool{};            // that is measured
  std::array<double, 3> b_axis{};  // what B turns about, right-handed
  std::span<const double> b_angles_rad;
  std::span<const std::uint32_t> tools;
  double shank_height_mm{};  // the last of the tools touches with its shank; 0: none does
  double c_on_line_rad{};    // how C stands at the zero of the first loop
  RimLoops loops{};
};
Chosen chosen(const MethodRow& row, const ProcedureOptions& options);

// C at several angles, over as much as --arc chooses.
bool spreadsC(const MethodRow& row);
// At as many as --angles chooses.
bool countsAngles(const MethodRow& row);
// B at several angles, as machine.toml describes.
bool turnsB(const MethodRow& row);

// One tool after the other carries the probe.
bool changesTools(const MethodRow& row);

struct Pose {
  std::array<double, 3> angles_rad{};  // A B C
  std::uint16_t ball{};                // of the part, from 1; 0 for another feature
  BMoves b_moves{};
  std::uint32_t tool{};  // 0: whichever carries the probe
  bool by_shank{};
  capture::RimStep rim{};
};
std::size_t poseCount(const MethodRow& row, const Chosen& with);
Pose poseOf(const MethodRow& row, const Chosen& with, std::size_t index);

// In machine axes. They swivel with the head, since the stylus has to come from its own side; one where the stem of the
// ball stands, which holds it from below and tilts with a table, is left out. A shank touches across the tool alone,
// and not from below: there what hangs on it would cross the stem.
class Sides {
 public:
  Sides(const MethodRow& row, const Chosen& with, const Pose& pose);
  std::span<const Side> list() const { return std::span{sides_}.first(count_); }

 private:
  std::array<Side, std::max(kSphereSides.size(), kSetterSides.size())> sides_{};
  std::size_t count_{};
};

}  // namespace probebox::procedure
