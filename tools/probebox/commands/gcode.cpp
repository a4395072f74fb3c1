#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/loop/loop.hpp"
#include "tools/gcode/mask.hpp"
#include "tools/gcode/picture.hpp"
#include "tools/gcode/place_of.hpp"
#include "tools/gcode/program.hpp"
#include "tools/gcode/setting.hpp"
#include "tools/gcode/unroll.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// Reads the options of `gcode` about machine and control, and checks them against the run.

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

// Axis about which B turns right-handed.
Eigen::Vector3d bAxisOf(const Gcode& options) {
  const double sign = options.b_axis.starts_with('-') ? -1 : 1;
  return sign * (options.b_axis.ends_with('Y') ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX());
}

// ISO 841: a table or head that turns about X is named A, about Y B.
Outcome<gcode::Words, Trouble> wordsOf(const Gcode& options) {
  gcode::Words words{"", bAxisOf(options).x() != 0 ? "A" : "B", "C"};
  for (const auto& given : options.words) {
    const std::string word = given.substr(2);
    if (word.ends_with('=') && !options.dialect.starts_with("siemens"))
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
  bool sphere{}, part_ball{}, plates{}, cylinder{}, cube{}, setter{}, stylus{}, cutting_tool{}, probe{},
      several_probes{}, head{}, b{}, table{}, place{};

  explicit Uses(const procedure::Plan& plan) {
    for (std::size_t i = 0; i < plan.step_count; ++i) {
      const Step& step = plan.steps[i];
      const bool holds = step.kind == procedure::Kind::hold, by_tool = step.touch.tool != 0;
      const bool works = !gcode::movesOneAxis(step) && step.kind != procedure::Kind::rest;
      const bool at_setter = works && step.feature == Feature::tool_setter;
      part_ball = part_ball || (works && step.feature == Feature::part_ball);
      sphere = sphere || (works && (step.feature == Feature::part_ball || step.feature == Feature::datum_sphere));
      plates = plates || (works && step.feature == Feature::plates);
      cylinder = cylinder || (works && step.feature == Feature::cylinder);
      cube = cube || (works && step.feature == Feature::cube);
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

// Trouble: two axes with one word, or a word that the dialect does not have.
Outcome<gcode::Setting, Trouble> settingOf(const Gcode& options, const gcode::Dialect& dialect) {
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
  setting.has_y = !dialect.isLathe();
  setting.orients = !options.no_orient && !dialect.isLathe();
  setting.ball_diameter_mm = options.sphere_mm;
  setting.gap_mm = options.gap_mm;
  setting.bore_mm = options.bore_mm;
  if (!options.cube_mm.empty()) setting.cube_mm = pointOf(options.cube_mm);
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

// Explains which fact the run needs from machine.toml, where none was given.
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
// Explains which option exceeds the limits of a run.
std::optional<Trouble> whyTooMany(const Gcode& options) {
  const auto objection = [](const char* option, std::size_t most) {
    return usage(std::string{option} + ": a run has up to " + std::to_string(most) + " of them: omit some");
  };
  if (options.tilts_deg.size() > kMostBAngles) return objection("--tilts", kMostBAngles);
  if (options.probe_tools.size() > kMostProbeTools) return objection("--probe-tools", kMostProbeTools);
  return std::nullopt;
}

// Explains which given option this run does not use: it is probably meant for another run.
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
                       Use{"--bore", options.bore_mm.has_value(), uses.cylinder},
                       Use{"--cube", !options.cube_mm.empty(), uses.cube},
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

// Explains which option a lathe of X and Z cannot have.
std::optional<Trouble> whyNotOfLathe(const Gcode& options, const gcode::Dialect& dialect) {
  if (!dialect.isLathe()) return std::nullopt;
  if (pointOf(options.at_mm).y() != 0) return usage("--at: a lathe of X and Z has no Y, give 0 for it");
  if (&dialect != &gcode::fanucLathe()) return std::nullopt;
  if (options.machine_z_mm)
    return usage("--machine-z is not for fanuc-lathe, whose turret turns at the reference point (G28): omit it");
  constexpr std::uint32_t kMostStation = 99;  // two digits of T
  auto numbers = options.probe_tools;
  if (options.tool) numbers.push_back(*options.tool);
  if (std::ranges::any_of(numbers, [](std::uint32_t number) { return number > kMostStation; }))
    return usage("fanuc-lathe has two digits of T for a station: give tools up to 99");
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

using procedure::Feature;

// Facts from machine.toml about the axes and tools that the steps name.
procedure::Facts factsOf(const Gcode& options, const gcode::Dialect& dialect) {
  procedure::Facts facts = plan::factsOf({.has_y = !dialect.isLathe()}, options.tool.value_or(0));
  const Eigen::Vector3d about = bAxisOf(options);
  const std::array<double, 3> axis{about.x(), about.y(), about.z()};
  const auto describe = [&](procedure::BFacts& b) {
    b.axis = axis;
    b.count = options.tilts_deg.size();
    for (std::size_t i = 0; i < b.count; ++i) b.angles_rad[i] = radians(options.tilts_deg[i]);
  };
  describe(*facts.tilting_table);
  describe(facts.swivel_head->b);
  if (!options.probe_tools.empty()) {
    facts.probe_tools.count = options.probe_tools.size();
    std::copy_n(options.probe_tools.begin(), facts.probe_tools.count, facts.probe_tools.numbers.begin());
  }
  if (options.head_tool) facts.sensor_head->tool = *options.head_tool;
  if (options.sphere_mm) facts.sphere_diameter_mm = options.sphere_mm;
  if (options.stylus_mm) facts.stylus_ball_diameter_mm = *options.stylus_mm;
  return facts;
}

std::string zeroOf(const procedure::Plan& plan, const Gcode& options) {
  const bool at_zero = options.at_mm.empty();
  const procedure::Step& first = plan.steps[0];
  if (first.kind == procedure::Kind::rest) return "anywhere: nothing is approached.";
  if (gcode::movesOneAxis(first))
    return "so that the axis may travel from X and Y of --at at the safe height: from 0, 0 where --at was not given.";
  switch (first.feature) {
    case Feature::part_ball:
      return "as --ball and --c-axis were given; C = 0 where the balls were measured.";
    case Feature::plates:
      return at_zero ? "zero in the middle of the gap." : "the middle of the gap as --at was given.";
    case Feature::cylinder:
      return at_zero ? "zero in the middle of the bore." : "the middle of the bore as --at was given.";
    case Feature::cube:
      return at_zero ? "zero in the middle of the cube." : "the middle of the cube as --at was given.";
    case Feature::tool_setter:
      return at_zero ? "zero in the middle of the setting device." : "the setting device as --at was given.";
    case Feature::second_part_ball:  // refused before
    case Feature::datum_sphere:
      break;
  }
  return at_zero ? "zero in the centre of the sphere." : "the centre of the sphere as --at was given.";
}

std::optional<Trouble> write(const std::string& path, const std::string& text, bool force, Console& console) {
  auto output = Output::open(path, force, console.out());
  if (!output) return Trouble{ExitStatus::usage, std::string{kNotWritten}, output.error().what};
  if (output->write(text) && output->finish()) return std::nullopt;
  return Trouble{ExitStatus::usage, std::string{kNotWritten}, output->failure()};
}

struct Written {
  std::string program, picture;
  std::size_t steps{};
};

Outcome<Written, Trouble> unrolled(const Gcode& options) {
  TRY(const auto wanted, wantedOf(options));
  if (auto trouble = whyTooMany(options)) return *trouble;
  if (!wanted.method->calibrates)
    return Trouble{ExitStatus::failed, "no-program",
                   options.method + " is done by hand, as the box asks for each step: run probebox " + options.method};
  const gcode::Dialect& dialect = *gcode::dialectNamed(options.dialect);
  if (auto trouble = whyNotOfLathe(options, dialect)) return *trouble;
  const auto completed = plan::completed(wanted, factsOf(options, dialect));
  if (!completed) return Trouble{ExitStatus::failed, completed.error().name, completed.error().reason};
  procedure::Plan plan;
  procedure::fill(plan, *wanted.method, *completed);
  if (options.number && !options.dialect.starts_with("fanuc") && &dialect != &gcode::haas())
    return usage("--number is of fanuc and haas: omit it, " + options.dialect + " names programs by their files");
  if (!options.tape.empty() && &dialect != &gcode::linuxcnc())
    return usage("--tape names the line to the box for linuxcnc alone: omit it; comments of the program name that of " +
                 options.dialect);
  if (auto trouble = whyNotGiven(options, plan, dialect)) return *trouble;
  if (auto trouble = whyNotUsed(options, plan)) return *trouble;
  TRY(const auto setting, settingOf(options, dialect));
  const auto blocks = gcode::unroll(plan, setting);
  if (!blocks) return Trouble{ExitStatus::failed, "no-program", blocks.error().what};
  if (auto error = gcode::whyMaskedTooLong(*blocks, setting, dialect))
    return Trouble{ExitStatus::failed, "no-program", error->what};
  if (auto error = gcode::whySwivelsUnguarded(*blocks, setting, dialect))
    return Trouble{ExitStatus::failed, "no-program", error->what};
  if (auto trouble = whyWordNotUsed(options, *blocks)) return *trouble;
  const std::string chosen = chosenOf(wanted);
  const gcode::Heading heading{.method = options.method,
                               .command = "probebox calibrate " + options.method + (chosen.empty() ? "" : " " + chosen),
                               .zero = zeroOf(plan, options),
                               .device = options.tape,
                               .number = options.number.value_or(gcode::Heading{}.number)};
  const auto marks = options.stops ? gcode::Marks::stops : gcode::Marks::lines;
  return Written{gcode::program(*blocks, setting, heading, dialect, marks),
                 gcode::picture(*blocks, setting, heading.command), plan.step_count};
}

// One program for all methods.
ExitStatus runLoop(const Gcode& options, Console& console) {
  const auto text =
      gcode::loop::loopProgram(options.dialect, options.axes,
                               static_cast<int>(options.number.value_or(gcode::loop::kFirstProgram)), options.frame);
  if (!text) return console.fail(usage(text.error().what));
  if (auto trouble = write(options.output, *text, options.force, console)) return console.fail(*trouble);
  if (options.output == "-") return ExitStatus::ok;
  if (console.json()) {
    console.object({{"output", options.output}});
  } else {
    console.line(options.output + ": the loop program for " + options.dialect + "; edit its places");
  }
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const Gcode& options, const std::string&, Console& console) {
  if (options.loop) return runLoop(options, console);
  if (options.picture == options.output)
    return console.fail(usage("--picture " + options.picture + ": program and picture need a file of their own"));
  if (options.picture == "-") console.keepOutputForData();
  const auto written = unrolled(options);
  if (!written) return console.fail(written.error());
  const bool only_picture = options.output.ends_with(".svg");
  if (auto trouble = write(options.output, only_picture ? written->picture : written->program, options.force, console))
    return console.fail(*trouble);
  if (!options.picture.empty()) {
    if (auto trouble = write(options.picture, written->picture, options.force, console)) return console.fail(*trouble);
  }
  if (options.output == "-") return ExitStatus::ok;
  if (console.json()) {
    console.object({{"output", options.output}, {"picture", options.picture}, {"steps", written->steps}});
  } else {
    console.line(options.output + ": " + std::to_string(written->steps) + " steps for " + options.dialect);
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
