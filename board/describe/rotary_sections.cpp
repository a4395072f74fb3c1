#include "board/describe/rotary_sections.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "board/describe/places.hpp"
#include "board/describe/secondary_axes.hpp"
#include "board/describe/tool_sections.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::board {
namespace {

constexpr double kUsualStale_s = 0.25;
constexpr double kUsualSpeed_deg_s = 36'000;  // 100 turns a second
constexpr std::string_view kLetters = "ABC";

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
  if (section.good("sense") && axis.sense == 0)
    section.problem("sense", "= 0 is no direction: write 1 where counts rise with the angle, else -1");
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
  table.between = static_cast<BetweenAngles>(section.choice("between", {"linear", "fourier"}, 0));
  table.at_tip = section.choice("tool_point", {"position", "tip"}) == 1;
  if (table.at_tip) {
    const auto& d = table.tool_direction = section.vector("tool_direction", {-1, 1});
    const double length = std::hypot(d[0], d[1], d[2]);
    if (section.good("tool_direction") && std::abs(length - 1) > 1e-6)
      section.problem("tool_direction",
                      "has the length " + plain(length) + ": write one of length 1, such as [0, 0, -1]");
    table.measured_length_mm = section.number("measured_length_mm", {0, 2000});
  }
  table.hold_s = section.number("hold_s", kDuration_s, hold_s);
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

}  // namespace

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
    section->finish();
  }
  if (auto section = root.sectionIfThere("swivel_head")) machine.swivel_head = readHead(std::move(*section), machine);
  if (auto section = root.sectionIfThere("probe_tools")) readProbeTools(std::move(*section), machine);
}

}  // namespace probebox::board
