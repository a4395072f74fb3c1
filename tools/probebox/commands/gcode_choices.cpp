#include "tools/probebox/commands/gcode_choices.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "tools/gcode/place_of.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {
namespace {

using procedure::Feature;
using procedure::Step;

Eigen::Vector3d pointOf(const std::vector<double>& given) {
  return given.size() == 3 ? Eigen::Vector3d{given[0], given[1], given[2]} : Eigen::Vector3d::Zero();
}

// "10,-20.5,30", which the command line has checked.
Eigen::Vector3d pointOf(const std::string& text) {
  Eigen::Vector3d point;
  const char* from = text.c_str();
  for (double& value : point) {
    char* end = nullptr;
    value = std::strtod(from, &end);
    from = end + (*end == ',' ? 1 : 0);
  }
  return point;
}

// ISO 841: a table or head that turns about X is named A, about Y B.
Outcome<gcode::Words, Trouble> wordsOf(const Gcode& options) {
  gcode::Words words{"", bAxisOf(options).x() != 0 ? "A" : "B", "C"};
  for (const auto& given : options.words) {
    const std::string word = given.substr(2);
    if (word.ends_with('=') && options.dialect != "siemens")
      return usage("--words " + given + ": " + options.dialect + " has no words that end with =");
    if (!gcode::isAxisWord(word) && given.front() != 'A')
      return usage("--words " + given + ": B and C are axes, give a word such as B, A or C1=");
    words[static_cast<std::size_t>(given.front() - 'A')] = word;
  }
  for (std::size_t axis = 0; axis < words.size(); ++axis) {
    const std::size_t other = (axis + 1) % words.size();
    if (words[axis].empty() || words[axis] != words[other]) continue;
    return usage("--words: the box's " + std::string{"ABC"[axis]} + " and " + "ABC"[other] + " would both be " +
                 words[axis] + " of the control: name another word for one of them");
  }
  return words;
}

// Features, tools and axes that the steps of a run use.
struct Uses {
  bool sphere{}, part_ball{}, plates{}, setter{}, stylus{}, cutting_tool{}, probe{}, several_probes{}, head{}, b{},
      table{}, place{};

  explicit Uses(const procedure::Plan& plan) {
    for (std::size_t i = 0; i < plan.step_count; ++i) {
      const Step& step = plan.steps[i];
      const bool holds = step.kind == procedure::Kind::hold, by_tool = step.touch.tool != 0;
      const bool works = !gcode::movesOneAxis(step) && step.kind != procedure::Kind::rest;
      const bool at_setter = works && step.feature == Feature::tool_setter;
      part_ball = part_ball || (works && step.feature == Feature::part_ball);
      sphere = sphere || (works && (step.feature == Feature::part_ball || step.feature == Feature::datum_sphere));
      plates = plates || (works && step.feature == Feature::plates);
      setter = setter || at_setter;
      cutting_tool = cutting_tool || (at_setter && by_tool);
      stylus = stylus || (works && !(at_setter && by_tool));
      probe = probe || (!holds && !(at_setter && by_tool));
      several_probes = several_probes || (!holds && !at_setter && by_tool);
      head = head || holds;
      b = b || step.b_moves != procedure::BMoves::nothing;
      table = table || step.b_moves == procedure::BMoves::table;
      place = place || !works || step.feature != Feature::part_ball;
    }
  }
};

}  // namespace

Eigen::Vector3d bAxisOf(const Gcode& options) {
  const double sign = options.b_axis.starts_with('-') ? -1 : 1;
  return sign * (options.b_axis.ends_with('Y') ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX());
}

Outcome<gcode::Setting, Trouble> settingOf(const Gcode& options) {
  gcode::Setting setting;
  setting.at_mm = pointOf(options.at_mm);
  for (const auto& ball : options.balls_mm) setting.balls_mm.push_back(pointOf(ball));
  setting.c_axis_mm = pointOf(options.c_axis_mm);
  if (!options.table_axis_mm.empty()) setting.table_axis_mm = pointOf(options.table_axis_mm);
  setting.b_axis = bAxisOf(options);
  TRY(setting.words, wordsOf(options));
  setting.machine_z_mm = options.machine_z_mm.value_or(0);
  setting.deflection_limit_mm = options.deflection_limit_mm;
  setting.guard = !options.no_skip;
  setting.orients = !options.no_orient;
  setting.ball_diameter_mm = options.sphere_mm;
  setting.gap_mm = options.gap_mm;
  setting.setter_width_mm = options.setter_mm;
  setting.stylus_diameter_mm = options.stylus_mm;
  setting.tool_diameter_mm = options.tool_diameter_mm;
  if (!options.probe_tools.empty()) setting.probe_tool = options.probe_tools.front();
  setting.safe_z_mm = options.safe_z_mm;
  setting.traverse_mm_min = std::min(options.traverse_mm_min, options.most_mm_min);
  setting.near_mm_min = std::min(setting.near_mm_min, setting.traverse_mm_min);
  setting.most_mm_min = options.most_mm_min;
  return setting;
}

std::optional<Trouble> whyNotGiven(const Gcode& options, const procedure::Plan& plan, const gcode::Dialect& dialect) {
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    const procedure::Step& step = plan.steps[i];
    const bool holds = step.kind == procedure::Kind::hold;
    if (holds && !options.head_tool)
      return usage("a sensor head holds over the ball: give its tool, --head-tool NUMBER");
    if (!holds && step.touch.tool != 0 && step.feature != Feature::tool_setter && options.probe_tools.empty())
      return usage("this run changes the tools that carry the probe: give --probe-tools, as machine.toml numbers them");
    if (step.b_moves != procedure::BMoves::nothing && options.tilts_deg.empty())
      return usage("this run turns B: give --tilts, the angles that machine.toml has");
    const bool head = step.b_moves == procedure::BMoves::head;
    if (head && !dialect.hasTipControl())
      return usage(std::string{dialect.name()} +
                   " has no code that keeps the tip in place while a head swivels: let the control read its steps from "
                   "the box (docs/integrator.md)");
  }
  return std::nullopt;
}

// Left out silently, the program would measure less than was asked for.
std::optional<Trouble> whyTooMany(const Gcode& options) {
  const auto objection = [](const char* option, std::size_t most) {
    return usage(std::string{option} + ": a run has up to " + std::to_string(most) + " of them: omit some");
  };
  if (options.tilts_deg.size() > kMostBAngles) return objection("--tilts", kMostBAngles);
  if (options.probe_tools.size() > kMostProbeTools) return objection("--probe-tools", kMostProbeTools);
  return std::nullopt;
}

std::optional<Trouble> whyNotUsed(const Gcode& options, const procedure::Plan& plan) {
  const Uses uses{plan};
  struct Use {
    const char* option;
    bool given, used;
  };
  const std::array all{Use{"--at", !options.at_mm.empty(), uses.place},
                       Use{"--ball", !options.balls_mm.empty(), uses.part_ball},
                       Use{"--c-axis", !options.c_axis_mm.empty(), uses.part_ball},
                       Use{"--table-axis", !options.table_axis_mm.empty(), uses.table},
                       Use{"--b-axis", !options.b_axis.empty(), uses.b},
                       Use{"--tilts", !options.tilts_deg.empty(), uses.b},
                       Use{"--probe-tools", !options.probe_tools.empty(), uses.probe},
                       Use{"--head-tool", options.head_tool.has_value(), uses.head},
                       Use{"--sphere", options.sphere_mm.has_value(), uses.sphere},
                       Use{"--gap", options.gap_mm.has_value(), uses.plates},
                       Use{"--setter", options.setter_mm.has_value(), uses.setter},
                       Use{"--stylus", options.stylus_mm.has_value(), uses.stylus},
                       Use{"--tool-diameter", options.tool_diameter_mm.has_value(), uses.cutting_tool}};
  for (const auto& [option, given, used] : all) {
    if (given && !used) return usage(options.method + " does not use " + option + ": omit it");
  }
  if (options.probe_tools.size() > 1 && !uses.several_probes)
    return usage(options.method + " has one tool that carries the probe: give one to --probe-tools");
  return std::nullopt;
}

std::optional<Trouble> whyWordNotUsed(const Gcode& options, const gcode::Blocks& blocks) {
  std::array<bool, 3> used{};
  for (const auto& block : blocks) {
    const auto* turn = std::get_if<gcode::Turn>(&block);
    for (std::size_t axis = 0; turn != nullptr && axis < used.size(); ++axis) used[axis] |= turn->used[axis];
  }
  for (const auto& word : options.words) {
    if (!used[static_cast<std::size_t>(word.front() - 'A')])
      return usage("--words " + word + ": this run does not turn " + word.front() + ", omit it");
  }
  return std::nullopt;
}

}  // namespace probebox::command
