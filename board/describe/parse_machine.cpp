#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "board/describe/document.hpp"
#include "board/describe/head_sections.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/rotary_sections.hpp"
#include "board/describe/shank_sections.hpp"
#include "board/describe/tool_sections.hpp"

namespace probebox::board {
namespace {

// The registers of the CNC end here.
constexpr Range kCorrection_mm{0, 3.2767};
constexpr Range kPosition_mm{-1e6, 1e6};
constexpr Range kSeconds{0, 3600};

ReferenceDescription readReference(Section& axis) {
  ReferenceDescription reference;
  reference.by = static_cast<ReferenceBy>(
      axis.choice("reference", {"absolute", "index", "homing"}, static_cast<std::size_t>(reference.by)));
  const bool has_mark = reference.by == ReferenceBy::index || axis.has("index_mm");
  if (!has_mark) {
    reference.maximum_speed_mm_s = axis.number("maximum_speed_mm_s", {1, 1e5}, reference.maximum_speed_mm_s);
    return reference;
  }
  reference.has_index = true;
  reference.index_mm = axis.number("index_mm", kPosition_mm);
  reference.index_width_mm = axis.number("index_width_mm", {0, 100}, 0);
  reference.index_pitch_mm = axis.number("index_pitch_mm", {0, 1e4}, 0);
  reference.index_tolerance_mm = axis.number("index_tolerance_mm", {1e-4, 10}, reference.index_tolerance_mm);
  reference.maximum_speed_mm_s = axis.number("maximum_speed_mm_s", {1, 1e5}, reference.maximum_speed_mm_s);
  if (reference.by == ReferenceBy::index && reference.index_pitch_mm > 0) {
    axis.problem(*axis.node("index_pitch_mm"),
                 "marks that repeat do not tell which one was passed: write reference = \"homing\", and the marks will "
                 "be checked after it");
  }
  return reference;
}

AxisDescription readAxis(Section section) {
  AxisDescription axis;
  axis.counts_per_mm = section.number("counts_per_mm", {1e-3, 1e9});
  axis.sense = static_cast<int>(section.integer("sense", {-1, 1}));
  if (axis.sense == 0) {
    section.problem(*section.node("sense"), "'sense' = 0: write 1 when counts rise with the position, else -1");
  }
  axis.travel_min_mm = section.number("travel_min_mm", kPosition_mm);
  axis.travel_max_mm = section.number("travel_max_mm", kPosition_mm);
  if (section.has("travel_min_mm") && section.has("travel_max_mm") && axis.travel_min_mm >= axis.travel_max_mm) {
    section.problem(*section.node("travel_max_mm"), "'travel_max_mm' is not above 'travel_min_mm': exchange them");
  }
  axis.reference = readReference(section);
  axis.correction_limit_mm = section.number("correction_limit_mm", kCorrection_mm);
  axis.correction_rate_mm_s = section.number("correction_rate_mm_s", {kTiny, 1000});
  section.finish();
  return axis;
}

// A size that an optional section gives.
std::optional<double> readSize(Section section, bool present, std::string_view key) {
  if (!present) return std::nullopt;
  const double size_mm = section.number(key, {0.1, 1000});
  section.finish();
  return size_mm;
}

ScrewDescription readScrew(Section section, double hold_s) {
  ScrewDescription screw;
  screw.length_mm = section.number("length_mm", {1, 1e5});
  screw.offset_mm = section.number("offset_mm", kPosition_mm);
  screw.pitch_mm = section.number("pitch_mm", {0.1, 1000});
  screw.fixed_bearing = static_cast<FixedBearing>(section.choice("fixed_bearing", {"low", "high"}));
  screw.gain = section.number("gain", {-100, 100});
  screw.gain_is = static_cast<GainIs>(section.choice("gain_is", {"correction", "error"}));
  screw.reference_um = section.number("reference_um", {-1e5, 1e5}, 0);
  screw.extension_min_um = section.number("extension_min_um", {-1e4, 1e4}, -50);
  screw.extension_max_um = section.number("extension_max_um", {-1e4, 1e4}, 300);
  screw.rate_um_s = section.number("rate_um_s", {kTiny, 1e4}, 5);
  screw.threshold_rpm = section.number("threshold_rpm", {0, 1e5}, 60);
  screw.sector_zero_mm = section.number("sector_zero_mm", kPosition_mm, 0);
  screw.stale_s = section.number("stale_s", {1e-3, 3600}, 1);
  screw.hold_s = section.number("hold_s", kSeconds, hold_s);
  if (section.has("extension_max_um") && screw.extension_min_um >= screw.extension_max_um) {
    section.problem(*section.node("extension_max_um"),
                    "'extension_max_um' is not above 'extension_min_um': exchange them");
  }
  section.finish();
  return screw;
}

PeriodicCheckDescription readPeriodicCheck(Section section) {
  const auto optional = [&](std::string_view key, Range range) -> std::optional<double> {
    if (!section.has(key)) return std::nullopt;
    return section.number(key, range);
  };
  PeriodicCheckDescription check;
  check.ball_diameter_mm = section.number("ball_diameter_mm", {0.1, 1000});
  check.ball_centre_z_mm = section.number("ball_centre_z_mm", kPosition_mm);
  check.accepted_x_mm = optional("accepted_x_mm", kPosition_mm);
  check.accepted_y_mm = optional("accepted_y_mm", kPosition_mm);
  check.limit_mm = optional("limit_mm", {1e-6, 100});
  section.finish();
  return check;
}

CentrelineDescription readCentreline(Section section, double hold_s) {
  CentrelineDescription centreline;
  centreline.assumed_x_mm = section.number("assumed_x_mm", kPosition_mm, 0);
  centreline.assumed_y_mm = section.number("assumed_y_mm", kPosition_mm, 0);
  centreline.correct_x = section.flag("correct_x", true);
  centreline.correct_y = section.flag("correct_y", true);
  centreline.hold_s = section.number("hold_s", kSeconds, hold_s);
  section.finish();
  return centreline;
}

CorrectionsDescription readCorrections(Section section) {
  // By bit of the mask.
  constexpr std::array<std::string_view, 4> kSources{"screw", "swivel", "rotary", "centreline"};
  CorrectionsDescription corrections;
  corrections.hold_s = section.number("hold_s", kSeconds);
  if (section.has("sources")) {
    const auto& node = *section.node("sources");
    for (const auto& name : section.texts("sources")) {
      const auto found = std::ranges::find(kSources, name);
      const auto bit = static_cast<unsigned>(found - kSources.begin());
      if (found == kSources.end()) {
        section.problem(
            node, "'sources' names '" + name + "': there are \"screw\", \"swivel\", \"rotary\" and \"centreline\"");
      } else {
        corrections.mask = static_cast<std::uint16_t>(corrections.mask | 1U << bit);
      }
    }
  }
  section.finish();
  return corrections;
}

BallPlateDescription readBallPlate(Section section) {
  constexpr Range kPlace_mm{-10'000, 10'000};
  BallPlateDescription plate;
  plate.axis_point_mm = section.vector("axis_point_mm", kPlace_mm);
  if (section.has("sd_mm")) plate.sd_mm = section.number("sd_mm", {1e-6, 0.1});
  const auto* list = section.node("ball");
  for (auto& ball : section.sections("ball")) {
    plate.balls_mm.push_back(ball.vector("at_mm", kPlace_mm));
    ball.finish();
  }
  if (list != nullptr && (plate.balls_mm.size() < 3 || plate.balls_mm.size() > kMostPlateBalls)) {
    section.problem(*list, std::to_string(plate.balls_mm.size()) + " balls do not make a plate: describe 3 to " +
                               std::to_string(kMostPlateBalls) + ", each as [[ball_plate.ball]]");
  }
  section.finish();
  return plate;
}

Machine readMachine(Section& root) {
  Machine machine;
  auto identity = root.section("machine");
  machine.name = identity.text("name");
  machine.mounting = identity.text("mounting", "spindle");
  machine.x_programming =
      identity.choice("x_programming", {"radius", "diameter"}, 0) == 0 ? Programming::radius : Programming::diameter;
  identity.finish();

  auto axes = root.section("axis");
  machine.axes = {readAxis(axes.section("X")), readAxis(axes.section("Y")), readAxis(axes.section("Z"))};
  axes.finish();

  const bool has_sphere = root.has("datum_sphere"), has_plates = root.has("datum_plates");
  machine.datum_sphere_diameter_mm = readSize(root.section("datum_sphere", false), has_sphere, "diameter_mm");
  machine.datum_gap_mm = readSize(root.section("datum_plates", false), has_plates, "gap_mm");
  auto rotary = root.section("rotary_c", false);
  machine.sigma_c_rad = rotary.number("sigma_rad", {0, 0.01}, 0.0);
  rotary.finish();

  const bool has_check = root.has("periodic_check");
  auto check = root.section("periodic_check", false);
  if (has_check) machine.periodic_check = readPeriodicCheck(std::move(check));

  const bool has_plate = root.has("ball_plate");
  auto plate = root.section("ball_plate", false);
  if (has_plate) machine.ball_plate = readBallPlate(std::move(plate));

  machine.corrections = readCorrections(root.section("corrections"));
  const double hold_s = machine.corrections.hold_s;
  auto screws = root.section("screw", false);
  for (std::size_t axis = 0; axis < machine.screws.size(); ++axis) {
    const std::string name{"XYZ"[axis]};
    const bool described = screws.has(name);
    auto section = screws.section(name, false);
    if (described) machine.screws[axis] = readScrew(std::move(section), hold_s);
  }
  screws.finish();
  machine.centreline = readCentreline(root.section("centreline", false), hold_s);
  readTools(root, machine);
  readRotary(root, hold_s, machine);
  readToolSetter(root, machine);
  readSensorHead(root, machine);
  readProbeShank(root, machine);
  return machine;
}

}  // namespace

Outcome<Machine> parseMachine(std::string_view text, std::string_view file_name) {
  return readDocument<Machine>(text, file_name, readMachine);
}

}  // namespace probebox::board
