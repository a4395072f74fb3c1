#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "board/describe/machine.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/places.hpp"
#include "board/describe/secondary_axes.hpp"
#include "board/describe/section.hpp"
#include "board/describe/spelling.hpp"
#include "board/describe/tool_sections.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/correction_sources.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::board {
namespace {

constexpr double kUsualStale_s = 0.25;
constexpr double kUsualSpeed_deg_s = 36'000;  // 100 turns a second
constexpr std::string_view kLetters = "ABC";

void requireSense(Section& section, int sense, const std::string& of) {
  if (section.good("sense") && sense == 0)
    section.problem("sense", "= 0 is no direction: write 1 where counts rise with the " + of + ", else -1");
}

RotaryAxisDescription readRotaryAxis(Section section) {
  RotaryAxisDescription axis;
  axis.angle_from = static_cast<AngleFrom>(section.choice("angle_from", {"encoder", "controller"}));
  if (axis.angle_from == AngleFrom::controller) {
    axis.stale_s = section.number("stale_s", kDuration_s);
    section.finish();
    return axis;
  }
  axis.maximum_speed_deg_s = kUsualSpeed_deg_s;
  axis.stale_s = kUsualStale_s;
  RotaryAxisDescription::encoderKeys(axis, KeyReader{section});
  requireSense(section, axis.sense, "angle");
  axis.reference =
      section.choice("reference", {"absolute", "homing"}, 1) == 0 ? ReferenceBy::absolute : ReferenceBy::homing;
  section.finish();
  return axis;
}

// Notes a rotary axis whose angle the box would not know.
void requireDescribed(Section& section, std::string_view key, RotaryLetter letter, const Machine& machine) {
  const auto index = static_cast<std::size_t>(letter);
  if (machine.rotary_axes[index]) return;
  const std::string name{kLetters[index]};
  section.problem(key, "names the axis " + name + ", which is not described: add [rotary_axis." + name +
                           "], which says where its angle comes from");
}

SwivelDescription readSwivel(Section section, double hold_s, const Machine& machine) {
  SwivelDescription swivel;
  swivel.hold_s = hold_s;
  readKeys(section, swivel);
  if (section.good("axis")) requireDescribed(section, "axis", swivel.axis, machine);
  section.finish();
  return swivel;
}

std::vector<RotaryLetter> readChain(Section& section, const Machine& machine) {
  std::vector<RotaryLetter> chain;
  section.node("chain");
  for (const auto& [name, line] : section.texts("chain", kLetters.size())) {
    const auto letter = name.size() == 1 ? kLetters.find(name) : std::string_view::npos;
    if (letter == std::string_view::npos) {
      section.problemAt(line, "chain",
                        "names " + inQuotes(name) +
                            ": write \"A\", \"B\" or \"C\" from the base outwards, such as "
                            "[\"B\", \"C\"]");
      continue;
    }
    const auto axis = static_cast<RotaryLetter>(letter);
    if (std::ranges::find(chain, axis) != chain.end())
      section.problemAt(line, "chain", "names the axis " + name + " twice: name it once");
    requireDescribed(section, "chain", axis, machine);
    if (machine.swivel && machine.swivel->axis == axis)
      section.problemAt(line, "chain",
                        "names the axis " + name +
                            ", and [swivel] has it as that of the head: an axis turns the table or the head, so remove "
                            "it from one of them");
    chain.push_back(axis);
  }
  if (section.good("chain") && chain.empty())
    section.problem("chain", "names no axis: write those that turn the table, such as [\"C\"]");
  return chain;
}

RotaryTableDescription readTable(Section section, double hold_s, const Machine& machine) {
  RotaryTableDescription table;
  table.chain = readChain(section, machine);
  table.hold_s = hold_s;
  readKeys(section, table);
  for (std::size_t axis = 0; axis < table.between_of.size(); ++axis)
    table.between_of.at(axis) = static_cast<BetweenAngles>(section.choice(
        std::string{"between_"} + "abc" [axis], { "linear", "fourier" }, static_cast<std::size_t>(table.between)));
  if (table.at_tip) {
    RotaryTableDescription::tipKeys(table, KeyReader{section});
    const auto& d = table.tool_direction;
    const double length = std::hypot(d[0], d[1], d[2]);
    if (section.good("tool_direction") && std::abs(length - 1) > 1e-6)
      section.problem("tool_direction",
                      "has the length " + plain(length) + ": write one of length 1, such as [0, 0, -1]");
  }
  section.finish();
  return table;
}

constexpr double kTurn_deg = 360;

// Of the shortest arc that has all angles, which rise: one turn without the widest gap between neighbours.
double arc_deg(const std::vector<double>& angles_deg) {
  double gap_deg = angles_deg.front() + kTurn_deg - angles_deg.back();
  for (std::size_t i = 1; i < angles_deg.size(); ++i) gap_deg = std::max(gap_deg, angles_deg[i] - angles_deg[i - 1]);
  return kTurn_deg - gap_deg;
}

// Notes angles whose readings differ too little to locate the axis. -180 and 180 degrees are one place.
void checkAngles(Section& section, std::string_view key, std::vector<double> angles_deg) {
  if (!section.good(key)) return;
  std::ranges::sort(angles_deg);
  if (std::ranges::adjacent_find(angles_deg) != angles_deg.end() || angles_deg.back() - angles_deg.front() >= kTurn_deg)
    section.problem(key, "lists an angle twice: list each angle once");
  if (arc_deg(angles_deg) < kLeastTiltSpan_deg)
    section.problem(key,
                    "spans less than 20 degrees, too little to locate an axis: spread the angles, such as [-90, 0]");
}

TiltDescription readTilt(Section& section, std::string_view angles) {
  constexpr std::array<std::array<double, 3>, 4> kAxes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
  TiltDescription tilt;
  tilt.axis = kAxes[section.choice("axis", {"X", "-X", "Y", "-Y"})];
  tilt.angles_deg = section.numbers(angles, {-180, 180}, {2, kMostTilts});
  checkAngles(section, angles, tilt.angles_deg);
  tilt.sigma_rad = section.number("sigma_rad", {0, 0.01}, 0.0);
  return tilt;
}

// Harmonics of B are determined by tilts all round, which few tables can take.
void requireEven(Section& section, const Machine& machine) {
  const auto& table = machine.rotary_table;
  const bool turns_b = table && std::ranges::find(table->chain, RotaryLetter::b) != table->chain.end();
  if (!turns_b || table->between_of[1] != BetweenAngles::fourier || !section.good("tilts_deg")) return;
  std::vector<double> rising_rad;
  for (const double tilt_deg : machine.tilting_table->angles_deg) rising_rad.push_back(radians(tilt_deg));
  std::ranges::sort(rising_rad);
  if (areEvenOverTurn(rising_rad)) return;
  section.problem("tilts_deg",
                  "are not equally spaced over a whole turn, as interpolation of B by harmonics needs: write "
                  "between_b = \"linear\" in [rotary_table], or such tilts");
}

HeadDescription readHead(Section section, const Machine& machine) {
  HeadDescription head;
  head.swivel = readTilt(section, "angles_deg");
  readKeys(section, head);
  if (head.ball_mm) requireReachable(section, "ball_mm", *head.ball_mm, machine);
  if (head.sd_ball_mm && !head.ball_mm)
    section.problem("sd_ball_mm", "says how exactly 'ball_mm' is known, which is missing: add it, or remove this");
  section.finish();
  return head;
}

// Lengths are those of [[tool]].
void readProbeTools(Section section, Machine& machine) {
  for (const auto number : section.wholeNumbers("numbers", kToolNumbers, {1, kMostProbeTools})) {
    const auto found = std::ranges::find(machine.tools, number, &ToolDescription::number);
    if (found == machine.tools.end()) {
      section.problem("numbers", "names tool " + std::to_string(number) +
                                     ", whose length is not described: add a [[tool]] with this number");
      continue;
    }
    if (std::ranges::find(machine.probe_tools, number, &ToolDescription::number) != machine.probe_tools.end()) {
      section.problem("numbers", "names tool " + std::to_string(number) + " twice: name it once");
      continue;
    }
    machine.probe_tools.push_back(*found);
  }
  section.finish();
}

RimBallDescription readRimBall(Section section) {
  RimBallDescription ball;
  readKeys(section, ball);
  if (ball.beside_mm.has_value() != ball.radius_mm.has_value())
    section.problem(ball.beside_mm ? "radius_mm" : "beside_mm",
                    "is missing: contacts by turning C need beside_mm and radius_mm, give both or neither");
  else if (ball.beside_mm && *ball.beside_mm > 0.8 * *ball.radius_mm)
    section.problem("beside_mm", "is more than 0.8 of radius_mm: the stylus must stand nearer to the line");
  section.finish();
  return ball;
}

// Reads the sections about rotary axes, all optional. hold_s: the default for sources without one.
void readRotary(Section& root, double hold_s, Machine& machine) {
  auto axes = root.section("rotary_axis", false);
  for (std::size_t axis = 0; axis < machine.rotary_axes.size(); ++axis) {
    if (auto section = axes.sectionIfThere(std::string{kLetters[axis]}))
      machine.rotary_axes.at(axis) = readRotaryAxis(std::move(*section));
  }
  refuseSecondaryAxes(axes);
  axes.finish();
  if (auto section = root.sectionIfThere("swivel")) machine.swivel = readSwivel(std::move(*section), hold_s, machine);
  if (auto section = root.sectionIfThere("rotary_table"))
    machine.rotary_table = readTable(std::move(*section), hold_s, machine);
  if (auto section = root.sectionIfThere("rim_ball")) machine.rim_ball = readRimBall(std::move(*section));
  if (auto section = root.sectionIfThere("tilting_table")) {
    machine.tilting_table = readTilt(*section, "tilts_deg");
    machine.tilting_table->point_mm = section->vectorIfThere("point_mm", kPosition_mm);
    if (!machine.tilting_table->point_mm && machine.ball_plate)
      machine.tilting_table->point_mm = machine.ball_plate->b_axis_point_mm;
    requireEven(*section, machine);
    section->finish();
  }
  if (auto section = root.sectionIfThere("swivel_head")) machine.swivel_head = readHead(std::move(*section), machine);
  if (auto section = root.sectionIfThere("probe_tools")) readProbeTools(std::move(*section), machine);
}

// Reads the ball screws of machine.toml: [screw.X] to [screw.Z], all optional. Private to the room.

// (D1): the nut is between the fixed bearing and the sensor wherever the axis stands.
void requireNutOnScrew(Section& section, const ScrewDescription& screw, const AxisDescription& axis) {
  for (const char* const key : {"length_mm", "offset_mm", "fixed_bearing"})
    if (!section.good(key)) return;
  if (axis.travel_min_mm >= axis.travel_max_mm) return;
  const double near_mm = screw.reversed ? screw.offset_mm - axis.travel_max_mm : screw.offset_mm + axis.travel_min_mm;
  const double far_mm = near_mm + axis.travel_max_mm - axis.travel_min_mm;
  if (near_mm < 0)
    section.problem("offset_mm", "= " + plain(screw.offset_mm) + " puts the nut " + plain(-near_mm) +
                                     " mm beyond the fixed bearing at one end of the travel: write the distance from "
                                     "that bearing to machine position 0, positive on the side of the screw");
  if (far_mm > screw.length_mm)
    section.problem("length_mm", "= " + plain(screw.length_mm) + " is too short: at one end of the travel the nut is " +
                                     plain(far_mm) +
                                     " mm from the fixed bearing; write the distance from that bearing "
                                     "to the sensor, or correct 'offset_mm'");
}

void requireGain(Section& section, double gain) {
  constexpr double kLeast = 0.1;
  if (section.good("gain") && std::abs(gain) < kLeast)
    section.problem("gain", "= " + plain(gain) +
                                " leaves the screw uncorrected, and its source good: write K, about 1 or -1, or remove "
                                "the screw");
}

ScrewDescription readScrew(Section section, double hold_s, const AxisDescription& axis) {
  ScrewDescription screw;
  screw.hold_s = hold_s;
  readKeys(section, screw);
  requireNutOnScrew(section, screw, axis);
  requireGain(section, screw.gain);
  if (screw.extension_min_um >= screw.extension_max_um) {
    const char* const key = section.good("extension_max_um") ? "extension_max_um" : "extension_min_um";
    section.problem(key, "leaves no room from " + plain(screw.extension_min_um) + " to " +
                             plain(screw.extension_max_um) + " um: 'extension_max_um' is above 'extension_min_um'");
  }
  section.finish();
  return screw;
}

// Call it after the axes have been read. hold_s: the default for screws without one.
void readScrews(Section& root, double hold_s, Machine& machine) {
  auto screws = root.section("screw", false);
  for (std::size_t axis = 0; axis < machine.screws.size(); ++axis) {
    const std::string name{"XYZ"[axis]};
    auto section = screws.sectionIfThere(name);
    if (!section) continue;
    machine.screws.at(axis) = readScrew(std::move(*section), hold_s, machine.axes.at(axis));
    if (name == "Y" && !machine.has_y)
      screws.problem(name, "is there, and axes = \"XZ\" in [machine] says that the machine has no Y: remove it");
    if (machine.secondary_axes.at(axis))
      screws.problem(name, "needs the place of the nut of " + name + ", and [axis." +
                               std::string{kSecondaryAxes[axis]} +
                               "] adds another axis to its position: remove one of the two");
  }
  refuseSecondaryAxes(screws);
  screws.finish();
}

// Marks and the speed at which counts are still believed. The axis' travel has been read.
ReferenceDescription readReference(Section& axis) {
  ReferenceDescription reference;
  readKeys(axis, reference);
  if (reference.by != ReferenceBy::index && !axis.has("index_mm")) return reference;
  reference.has_index = true;
  ReferenceDescription::markKeys(reference, KeyReader{axis});
  if (reference.by == ReferenceBy::index && reference.index_pitch_mm > 0)
    axis.problem("index_pitch_mm",
                 "says that marks repeat, and repeated marks do not tell which one was passed: write reference = "
                 "\"homing\", and the marks check it");
  return reference;
}

// `number`: 0 X, 1 Y, 2 Z.
void readAxis(Section section, std::size_t number, Machine& machine) {
  auto& axis = machine.axes.at(number);
  readKeys(section, axis);
  requireSense(section, axis.sense, "position");
  if (section.good("travel_min_mm") && section.good("travel_max_mm") && axis.travel_min_mm >= axis.travel_max_mm)
    section.problem("travel_max_mm", "is not above 'travel_min_mm': exchange them");
  axis.reference = readReference(section);
  // Marks that repeat are counted from one that need not be on the travel.
  if (axis.reference.has_index && axis.reference.index_pitch_mm == 0)
    requireReachable(section, "index_mm", axis.reference.index_mm, number, machine);
  section.finish();
}

// A mark is passed by the primary axis alone, and says nothing of the sum.
void readSecondaryAxes(Section& axes, Machine& machine) {
  for (std::size_t number = 0; number < machine.secondary_axes.size(); ++number) {
    const std::string name{kSecondaryAxes[number]}, primary{"XYZ"[number]};
    auto section = axes.sectionIfThere(name);
    if (!section) continue;
    auto& axis = machine.secondary_axes.at(number).emplace();
    readKeys(*section, axis);
    requireSense(*section, axis.sense, "position");
    section->finish();
    if (machine.axes.at(number).reference.has_index)
      axes.problem(name, "is added to " + primary +
                             ", whose index mark says nothing of the sum: write reference = \"homing\" in [axis." +
                             primary + "], without index_mm, and let the control tell the sum after homing both");
  }
}

// The Y of a lathe of X and Z: it stands at 0 and is never corrected.
AxisDescription standingAxis() {
  constexpr double kAnyScale = 1e6;
  AxisDescription axis;
  axis.counts_per_mm = kAnyScale;
  axis.reference.by = ReferenceBy::absolute;
  return axis;
}

void readAxes(Section axes, Machine& machine) {
  for (std::size_t axis = 0; axis < machine.axes.size(); ++axis) {
    const std::string name{"XYZ"[axis]};
    if (name != "Y" || machine.has_y) {
      readAxis(axes.section(name), axis, machine);
    } else if (axes.sectionIfThere(name)) {
      axes.problem(name,
                   "is there, and axes = \"XZ\" in [machine] says that the machine has none: remove it, or write "
                   "axes = \"XYZ\"");
    } else {
      machine.axes[axis] = standingAxis();
    }
  }
  readSecondaryAxes(axes, machine);
  axes.finish();
}

void readDatumSphere(Section section, Machine& machine) {
  machine.datum_sphere_diameter_mm = section.number("diameter_mm", {0.1, 1000});
  machine.datum_sphere_sd_mm = section.numberIfThere("sd_diameter_mm", kSdOfSize.range);
  if (section.has("temperature_c") || section.has("expansion_per_k") || section.has("sd_temperature_k"))
    machine.datum_sphere_temperature =
        SphereTemperature{.celsius = section.numberIfThere("temperature_c", {kColdest_c, kWarmest_c}),
                          .sd_k = section.number("sd_temperature_k", {0, 20}, 0.0),
                          .expansion_per_k = section.number("expansion_per_k", {-1e-3, 1e-3})};
  section.finish();
}

// The check is defined at B = 0, 45 and 90 degrees, in the plane across Y.
std::vector<double> readCheckSwivels(Section& section, const Machine& machine) {
  auto swivels = section.numbers("swivels_deg", {0, 90}, {1, 3});
  if (!section.good("swivels_deg")) return {};
  const auto allowed = [](double deg) { return deg == 0 || deg == 45 || deg == 90; };
  const std::array<double, 3> about_y{0, 1, 0};
  if (!std::ranges::all_of(swivels, allowed)) {
    section.problem("swivels_deg", "names another angle than 0, 45 and 90 degrees, at which the check is defined");
  } else if (!machine.swivel_head || machine.swivel_head->swivel.axis != about_y) {
    section.problem("swivels_deg",
                    "needs a head that swivels about +Y: describe [swivel_head] axis = \"Y\", or remove this key");
  }
  std::erase(swivels, 0.0);
  std::ranges::sort(swivels);
  const auto copies = std::ranges::unique(swivels);
  swivels.erase(copies.begin(), copies.end());
  return swivels;
}

PeriodicCheckDescription readPeriodicCheck(Section section, const Machine& machine) {
  PeriodicCheckDescription check;
  readKeys(section, check);
  requireReachable(section, "ball_centre_z_mm", check.ball_centre_z_mm, 2, machine);
  if (check.accepted_x_mm) requireNear(section, "accepted_x_mm", *check.accepted_x_mm, 0, machine);
  if (check.accepted_y_mm && !machine.has_y)
    section.problem("accepted_y_mm", "is of an axis that this machine does not have: remove it");
  if (check.accepted_y_mm) requireNear(section, "accepted_y_mm", *check.accepted_y_mm, 1, machine);
  if (section.has("swivels_deg")) check.swivels_deg = readCheckSwivels(section, machine);
  section.finish();
  return check;
}

CentrelineDescription readCentreline(Section section, double hold_s, const Machine& machine) {
  CentrelineDescription centreline;
  centreline.hold_s = hold_s;
  readKeys(section, centreline);
  requireNear(section, "assumed_x_mm", centreline.assumed_x_mm, 0, machine);
  requireNear(section, "assumed_y_mm", centreline.assumed_y_mm, 1, machine);
  centreline.correct_y = centreline.correct_y && machine.has_y;
  section.finish();
  return centreline;
}

std::uint16_t readSources(Section& section, const Section& root) {
  std::vector<std::string> names;
  for (const auto& source : kSources) names.emplace_back(source.name);
  std::uint16_t mask = 0;
  for (const auto& [name, line] : section.texts("sources", names.size())) {
    const auto problem = [&](const std::string& what) {
      section.problemAt(line, "sources", "names " + inQuotes(name) + what);
    };
    const auto kind = static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
    if (kind == names.size()) {
      const auto meant = nearest(name, names);
      std::string known;
      for (const auto& each : names) known += (known.empty() ? "\"" : ", \"") + each + "\"";
      problem(", which is no source of corrections: " +
              (meant ? "did you mean \"" + *meant + "\"? There are " : std::string{"there are "}) + known);
      continue;
    }
    if (hasSource(mask, kind)) problem(" twice: name it once");
    if (const auto needs = kSources[kind].section; !needs.empty() && !root.holds(needs))
      problem(", but machine.toml describes " + std::string{kSources[kind].lacking} + ", or remove the name");
    mask = static_cast<std::uint16_t>(mask | bitOf(static_cast<SourceKind>(kind)));
  }
  return mask;
}

// Two balls cannot stand in one place: a table that was pasted twice.
void requireApart(Section& ball, const std::vector<std::array<double, 3>>& before, const std::array<double, 3>& at_mm) {
  constexpr double kLeast_mm = 1;
  const auto is_here = [&](const std::array<double, 3>& other) {
    return std::hypot(at_mm[0] - other[0], at_mm[1] - other[1], at_mm[2] - other[2]) < kLeast_mm;
  };
  if (std::ranges::any_of(before, is_here))
    ball.problem("at_mm", "is the place of a ball that stands before it: give each ball its certified place");
}

BallPlateDescription readBallPlate(Section section, const Machine& machine) {
  BallPlateDescription plate;
  readKeys(section, plate);
  for (const std::size_t axis : {0U, 1U})
    requireNear(section, "axis_point_mm", plate.axis_point_mm.at(axis), axis, machine);
  section.node("ball");
  for (auto& ball : section.sections("ball", kMostPlateBalls)) {
    const auto at_mm = ball.vector("at_mm", BallPlateDescription::kPlace.range);
    if (ball.good("at_mm")) requireApart(ball, plate.balls_mm, at_mm);
    plate.balls_mm.push_back(at_mm);
    ball.finish();
  }
  if (section.good("ball") && plate.balls_mm.size() < 3)
    section.problem("ball", "is there " + std::to_string(plate.balls_mm.size()) +
                                " times, too few for a plate: describe 3 to " + std::to_string(kMostPlateBalls) +
                                " balls, each as [[ball_plate.ball]]");
  section.finish();
  return plate;
}

// Where the probe sits is a name of the integrator's, and a result is found again by it alone.
std::string readMounting(Section& machine) {
  const std::vector<std::string> usual{"spindle", "turret", "table", "slide", "tailstock", "swivel head"};
  auto mounting = machine.text("mounting", "spindle");
  const bool numbered =
      std::ranges::any_of(usual, [&](const std::string& name) { return mounting.starts_with(name + " "); });
  const auto meant = numbered ? std::nullopt : nearest(mounting, usual);
  if (meant)
    machine.problem("mounting", "= " + inQuotes(mounting) + ": did you mean \"" + *meant +
                                    "\"? Results hold for one mounting and are found by this name");
  return mounting;
}

constexpr std::size_t kMostRequirements = 64;

void readRequirements(std::vector<Section> sections, Machine& machine) {
  for (auto& section : sections) {
    RequirementDescription one;
    readKeys(section, one);
    const std::array keys{one.limit_um, one.limit_us, one.limit_urad, one.every_days, one.cutting_h, one.temperature_k};
    if (std::ranges::none_of(keys, [](const auto& key) { return key.has_value(); }))
      section.problem(
          "subject", "has nothing to keep: add limit_um, limit_us, limit_urad, every_days, cutting_h or temperature_k");
    if (std::ranges::find(machine.requirements, one.subject, &RequirementDescription::subject) !=
        machine.requirements.end())
      section.problem("subject", "= \"" + one.subject + "\" has two [[requirement]] sections: write one");
    section.finish();
    machine.requirements.push_back(std::move(one));
  }
}

Machine readMachine(Section& root) {
  Machine machine;
  KeyReader{root}("like_sim", machine.like_sim, "what this file does not say is as in board/sim");
  auto identity = root.section("machine");
  machine.name = identity.text("name");
  machine.mounting = readMounting(identity);
  machine.x_programming =
      identity.choice("x_programming", {"radius", "diameter"}, 0) == 0 ? Programming::radius : Programming::diameter;
  machine.has_y = identity.choice("axes", {"XYZ", "XZ"}, 0) == 0;
  machine.has_second_spindle = identity.flag("second_spindle", false);
  identity.finish();

  readAxes(root.section("axis"), machine);

  if (auto sphere = root.sectionIfThere("datum_sphere")) readDatumSphere(std::move(*sphere), machine);
  machine.datum_plates = readByAxis<PlatesDescription>(root.section("datum_plates", false), "gap_mm");
  machine.datum_cylinder = readIfThere<CylinderDescription>(root, "datum_cylinder");
  machine.datum_cube = readIfThere<CubeDescription>(root, "datum_cube");
  if (auto accuracy = root.sectionIfThere("accuracy")) {
    readKeys(*accuracy, machine.accuracy.emplace());
    accuracy->finish();
  }
  auto rotary = root.section("rotary_c", false);
  machine.sigma_c_rad = rotary.number("sigma_rad", {0, 0.01}, 0.0);
  rotary.finish();

  if (auto plate = root.sectionIfThere("ball_plate")) machine.ball_plate = readBallPlate(std::move(*plate), machine);

  auto corrections = root.section("corrections");
  const double hold_s = machine.corrections.hold_s = corrections.number("hold_s", kDuration_s);
  readScrews(root, hold_s, machine);
  machine.centreline = readCentreline(root.section("centreline", false), hold_s, machine);
  readTools(root, machine);
  readRotary(root, hold_s, machine);
  if (auto check = root.sectionIfThere("periodic_check"))
    machine.periodic_check = readPeriodicCheck(std::move(*check), machine);
  readToolSetter(root, machine);
  readSensorHead(root, machine);
  readProbeShank(root, machine);
  machine.corrections.mask = readSources(corrections, root);
  corrections.finish();
  readRequirements(root.sections("requirement", kMostRequirements), machine);
  return machine;
}

}  // namespace

Outcome<Machine> parseMachine(std::string_view text, std::string_view file_name) {
  return readDocument<Machine>(text, file_name, readMachine,
                               [](toml::table& machine) { completeLikeSim(machine, "machine.toml"); });
}

}  // namespace probebox::board
