#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "firmware/procedure/plan/plan.hpp"
#include "protocol/units/angle.hpp"
#include "tools/gcode/loop/loop.hpp"
#include "tools/gcode/picture.hpp"
#include "tools/gcode/program.hpp"
#include "tools/gcode/unroll.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using procedure::Feature;

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

gcode::Setting settingOf(const Gcode& options) {
  gcode::Setting setting;
  setting.at_mm = pointOf(options.at_mm);
  for (const auto& ball : options.balls_mm) setting.balls_mm.push_back(pointOf(ball));
  setting.c_axis_mm = pointOf(options.c_axis_mm);
  if (!options.table_axis_mm.empty()) setting.table_axis_mm = pointOf(options.table_axis_mm);
  if (options.b_axis == "Y") setting.b_axis = Eigen::Vector3d::UnitY();
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

// What machine.toml says of the axes and tools that the steps name.
procedure::Facts factsOf(const Gcode& options) {
  procedure::Facts facts = plan::factsOf({}, options.tool.value_or(0));
  const auto describe = [&](procedure::BFacts& b) {
    b.axis = options.b_axis == "Y" ? std::array<double, 3>{0, 1, 0} : std::array<double, 3>{1, 0, 0};
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

// What a run depends on that only machine.toml has, and that was not given.
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
    if (head && dialect.tipControl({}).empty())
      return usage(std::string{dialect.name()} +
                   " has no code that keeps the tip in place while a head swivels: let the control read its steps from "
                   "the box (docs/integrator.md)");
  }
  return std::nullopt;
}

// What a run has no room for. Left out silently, the program would measure less than was asked for.
std::optional<Trouble> whyTooMany(const Gcode& options) {
  const auto objection = [](const char* option, std::size_t most) {
    return usage(std::string{option} + ": a run has up to " + std::to_string(most) + " of them: omit some");
  };
  if (options.tilts_deg.size() > kMostBAngles) return objection("--tilts", kMostBAngles);
  if (options.probe_tools.size() > kMostProbeTools) return objection("--probe-tools", kMostProbeTools);
  return std::nullopt;
}

std::string zeroOf(const procedure::Plan& plan, const Gcode& options) {
  const bool at_zero = options.at_mm.empty();
  switch (plan.steps[0].feature) {
    case Feature::part_ball:
      return "as --ball and --c-axis were given; C = 0 where the balls were measured.";
    case Feature::plates:
      return at_zero ? "zero in the middle of the gap." : "the middle of the gap as --at was given.";
    case Feature::tool_setter:
      return at_zero ? "zero in the middle of the setting device." : "the setting device as --at was given.";
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
  const auto completed = plan::completed(wanted, factsOf(options));
  if (!completed) return Trouble{ExitStatus::failed, completed.error().name, completed.error().reason};
  procedure::Plan plan;
  procedure::fill(plan, *wanted.method, *completed);
  const gcode::Dialect& dialect = *gcode::dialectNamed(options.dialect);
  if (!options.tape.empty() && &dialect != &gcode::linuxcnc())
    return usage("--tape names the line to the box for linuxcnc alone: omit it; comments of the program name that of " +
                 options.dialect);
  if (auto trouble = whyNotGiven(options, plan, dialect)) return *trouble;
  const auto setting = settingOf(options);
  const auto blocks = gcode::unroll(plan, setting);
  if (!blocks) return Trouble{ExitStatus::failed, "no-program", blocks.error().what};
  const std::string chosen = chosenOf(wanted);
  const gcode::Heading heading{.method = options.method,
                               .command = "probebox calibrate " + options.method + (chosen.empty() ? "" : " " + chosen),
                               .zero = zeroOf(plan, options),
                               .device = options.tape};
  const auto marks = options.stops ? gcode::Marks::stops : gcode::Marks::lines;
  return Written{gcode::program(*blocks, setting, heading, dialect, marks),
                 gcode::picture(*blocks, setting, heading.command), plan.step_count};
}

// One program for all methods.
ExitStatus runLoop(const Gcode& options, Console& console) {
  const auto text = gcode::loop::loopProgram(options.dialect, options.axes.empty() ? "XYZABC" : options.axes);
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
