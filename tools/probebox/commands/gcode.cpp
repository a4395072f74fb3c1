#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "firmware/procedure/plan/plan.hpp"
#include "protocol/units/angle.hpp"
#include "tools/gcode/loop/loop.hpp"
#include "tools/gcode/mask.hpp"
#include "tools/gcode/picture.hpp"
#include "tools/gcode/place_of.hpp"
#include "tools/gcode/program.hpp"
#include "tools/gcode/unroll.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/gcode_choices.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using procedure::Feature;

// Facts from machine.toml about the axes and tools that the steps name.
procedure::Facts factsOf(const Gcode& options) {
  procedure::Facts facts = plan::factsOf({}, options.tool.value_or(0));
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
  if (!wanted.method->calibrates)
    return Trouble{ExitStatus::failed, "no-program",
                   options.method + " is done by hand, as the box asks for each step: run probebox " + options.method};
  const auto completed = plan::completed(wanted, factsOf(options));
  if (!completed) return Trouble{ExitStatus::failed, completed.error().name, completed.error().reason};
  procedure::Plan plan;
  procedure::fill(plan, *wanted.method, *completed);
  const gcode::Dialect& dialect = *gcode::dialectNamed(options.dialect);
  if (options.number && &dialect != &gcode::fanuc() && &dialect != &gcode::haas())
    return usage("--number is of fanuc and haas: omit it, " + options.dialect + " names programs by their files");
  if (!options.tape.empty() && &dialect != &gcode::linuxcnc())
    return usage("--tape names the line to the box for linuxcnc alone: omit it; comments of the program name that of " +
                 options.dialect);
  if (auto trouble = whyNotGiven(options, plan, dialect)) return *trouble;
  if (auto trouble = whyNotUsed(options, plan)) return *trouble;
  TRY(const auto setting, settingOf(options));
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
  const auto text = gcode::loop::loopProgram(options.dialect, options.axes.empty() ? "XYZABC" : options.axes,
                                             static_cast<int>(options.number.value_or(gcode::loop::kFirstProgram)),
                                             options.frame.value_or(gcode::loop::kFrame));
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
