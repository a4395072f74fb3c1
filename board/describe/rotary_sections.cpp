#include "board/describe/rotary_sections.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "board/describe/tool_sections.hpp"

namespace probebox::board {
namespace {

constexpr Range kSeconds{0, 3600};
constexpr double kUsualStale_s = 0.25;
constexpr double kUsualSpeed_deg_s = 36'000;  // 100 turns a second
constexpr std::string_view kLetters = "ABC";

RotaryAxisDescription readRotaryAxis(Section section) {
  RotaryAxisDescription axis;
  axis.angle_from = static_cast<AngleFrom>(section.choice("angle_from", {"encoder", "controller"}));
  if (axis.angle_from == AngleFrom::controller) {
    axis.stale_s = section.number("stale_s", kSeconds);
    section.finish();
    return axis;
  }
  axis.counts_per_deg = section.number("counts_per_deg", {1e-3, 1e9});
  axis.sense = static_cast<int>(section.integer("sense", {-1, 1}));
  if (axis.sense == 0)
    section.problem(*section.node("sense"), "'sense' = 0: write 1 when counts rise with the angle, else -1");
  axis.reference =
      section.choice("reference", {"absolute", "homing"}, 1) == 0 ? ReferenceBy::absolute : ReferenceBy::homing;
  axis.maximum_speed_deg_s = section.number("maximum_speed_deg_s", {1, 1e6}, kUsualSpeed_deg_s);
  axis.stale_s = section.number("stale_s", {1e-3, 3600}, kUsualStale_s);
  section.finish();
  return axis;
}

// Without [rotary_axis.B] nobody would know the angle of B.
void requireDescribed(Section& section, std::string_view key, RotaryLetter letter, const Machine& machine) {
  const auto index = static_cast<std::size_t>(letter);
  if (machine.rotary_axes[index]) return;
  const std::string name{kLetters[index]};
  section.problem(*section.node(key), "'" + std::string{key} + "' names the axis " + name +
                                          ", whose angle nobody tells: add [rotary_axis." + name + "]");
}

SwivelDescription readSwivel(Section section, double hold_s, const Machine& machine) {
  SwivelDescription swivel;
  swivel.axis = static_cast<RotaryLetter>(section.choice("axis", {"A", "B", "C"}));
  if (section.has("axis")) requireDescribed(section, "axis", swivel.axis, machine);
  swivel.by_angle = section.flag("by_angle", false);
  swivel.hold_s = section.number("hold_s", kSeconds, hold_s);
  section.finish();
  return swivel;
}

std::vector<RotaryLetter> readChain(Section& section, const Machine& machine) {
  std::vector<RotaryLetter> chain;
  const auto* node = section.node("chain");
  if (node == nullptr) return chain;
  for (const auto& name : section.texts("chain")) {
    const auto letter = name.size() == 1 ? kLetters.find(name) : std::string_view::npos;
    if (letter == std::string_view::npos) {
      section.problem(*node,
                      "'chain' names '" + name + "': write the axes from the base outwards, such as [\"B\", \"C\"]");
      continue;
    }
    const auto axis = static_cast<RotaryLetter>(letter);
    if (std::ranges::find(chain, axis) != chain.end())
      section.problem(*node, "'chain' names the axis " + name + " twice");
    requireDescribed(section, "chain", axis, machine);
    chain.push_back(axis);
  }
  if (chain.empty()) section.problem(*node, "'chain' names no axis: write those that turn the table, such as [\"C\"]");
  return chain;
}

RotaryTableDescription readTable(Section section, double hold_s, const Machine& machine) {
  RotaryTableDescription table;
  table.chain = readChain(section, machine);
  table.between = static_cast<BetweenAngles>(section.choice("between", {"linear", "fourier"}, 0));
  table.at_tip = section.choice("tool_point", {"position", "tip"}) == 1;
  if (table.at_tip) {
    const auto& d = table.tool_direction = section.vector("tool_direction", {-1, 1});
    if (section.has("tool_direction") && std::abs(std::hypot(d[0], d[1], d[2]) - 1) > 1e-6)
      section.problem(*section.node("tool_direction"), "'tool_direction' has not the length 1: such as [0, 0, -1]");
    table.measured_length_mm = section.number("measured_length_mm", {0, 2000});
  }
  table.hold_s = section.number("hold_s", kSeconds, hold_s);
  section.finish();
  return table;
}

// Angles at which readings differ enough to tell the axis.
void checkAngles(Section& section, std::string_view key, const std::vector<double>& angles_deg) {
  constexpr double kLeastSpan_deg = 20;
  if (angles_deg.size() < 2) return;
  const std::string name{key};
  if (angles_deg.size() > kMostTilts)
    section.problem(*section.node(key),
                    "'" + name + "' has more than " + std::to_string(kMostTilts) + " angles: remove some");
  auto sorted = angles_deg;
  std::ranges::sort(sorted);
  if (std::ranges::adjacent_find(sorted) != sorted.end())
    section.problem(*section.node(key), "'" + name + "' has an angle twice: give each once");
  if (sorted.back() - sorted.front() < kLeastSpan_deg)
    section.problem(*section.node(key), "'" + name +
                                            "' spans less than 20 degrees, too little to see an axis: spread "
                                            "the angles, such as [-90, 0]");
}

TiltDescription readTilt(Section& section, std::string_view angles) {
  constexpr std::array<std::array<double, 3>, 4> kAxes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
  TiltDescription tilt;
  tilt.axis = kAxes[section.choice("axis", {"X", "-X", "Y", "-Y"})];
  tilt.angles_deg = section.numbers(angles, {-180, 180}, 2);
  checkAngles(section, angles, tilt.angles_deg);
  tilt.sigma_rad = section.number("sigma_rad", {0, 0.01}, 0.0);
  return tilt;
}

HeadDescription readHead(Section section) {
  HeadDescription head{.swivel = readTilt(section, "angles_deg"),
                       .pivot_mm = section.vector("pivot_mm", {-2000, 2000}),
                       .ball_mm = {},
                       .sd_ball_mm = {}};
  if (section.has("ball_mm")) head.ball_mm = section.vector("ball_mm", {-1e5, 1e5});
  if (section.has("sd_ball_mm")) {
    head.sd_ball_mm = section.number("sd_ball_mm", {1e-6, 1});
    if (!head.ball_mm) section.problem(*section.node("sd_ball_mm"), "'sd_ball_mm' is of 'ball_mm': give that too");
  }
  section.finish();
  return head;
}

// Lengths are those of [[tool]].
void readProbeTools(Section section, Machine& machine) {
  for (const double value : section.numbers("numbers", kToolNumbers, 1)) {
    const auto number = static_cast<std::uint32_t>(value);
    const auto found = std::ranges::find(machine.tools, number, &ToolDescription::number);
    const auto& node = *section.node("numbers");
    if (found == machine.tools.end()) {
      section.problem(
          node, "'numbers' names tool " + std::to_string(number) + ", whose length nobody tells: add [[tool]] with it");
      continue;
    }
    if (std::ranges::find(machine.probe_tools, number, &ToolDescription::number) != machine.probe_tools.end())
      section.problem(node, "'numbers' names tool " + std::to_string(number) + " twice: give it once");
    machine.probe_tools.push_back(*found);
  }
  if (machine.probe_tools.size() > kMostProbeTools)
    section.problem(*section.node("numbers"),
                    "'numbers' names more than " + std::to_string(kMostProbeTools) + " tools: remove some");
  section.finish();
}

RimBallDescription readRimBall(Section section) {
  RimBallDescription ball;
  ball.c_deg = section.number("c_deg", {-360, 360});
  if (section.has("level_limit_mm")) ball.level_limit_mm = section.number("level_limit_mm", {1e-4, 10});
  section.finish();
  return ball;
}

}  // namespace

void readRotary(Section& root, double hold_s, Machine& machine) {
  auto axes = root.section("rotary_axis", false);
  for (std::size_t axis = 0; axis < machine.rotary_axes.size(); ++axis) {
    const std::string name{kLetters[axis]};
    const bool described = axes.has(name);
    auto section = axes.section(name, false);
    if (described) machine.rotary_axes[axis] = readRotaryAxis(std::move(section));
  }
  axes.finish();
  const bool has_swivel = root.has("swivel"), has_table = root.has("rotary_table");
  auto swivel = root.section("swivel", false), table = root.section("rotary_table", false);
  if (has_swivel) machine.swivel = readSwivel(std::move(swivel), hold_s, machine);
  if (has_table) machine.rotary_table = readTable(std::move(table), hold_s, machine);
  const bool has_rim_ball = root.has("rim_ball");
  auto rim_ball = root.section("rim_ball", false);
  if (has_rim_ball) machine.rim_ball = readRimBall(std::move(rim_ball));
  const bool has_tilt = root.has("tilting_table");
  auto tilt = root.section("tilting_table", false);
  if (has_tilt) {
    machine.tilting_table = readTilt(tilt, "tilts_deg");
    tilt.finish();
  }
  const bool has_head = root.has("swivel_head"), has_probe_tools = root.has("probe_tools");
  auto head = root.section("swivel_head", false), probe_tools = root.section("probe_tools", false);
  if (has_head) machine.swivel_head = readHead(std::move(head));
  if (has_probe_tools) readProbeTools(std::move(probe_tools), machine);
}

}  // namespace probebox::board
