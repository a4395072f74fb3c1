#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "protocol/units/tolerances.hpp"
#include "tools/probebox/cli/gcode_options.hpp"
#include "tools/probebox/cli/method_help.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/subcommands.hpp"
#include "tools/probebox/cli/validators.hpp"

namespace probebox::command {

// Declares the commands that measure on a machine, with their forecasts and programs. Only parse.cpp includes this.
class RunCommands {
 public:
  explicit RunCommands(const MethodHelp& methods) : methods_{methods} {}
  void declare(Subcommands& commands) {
    commands.add("selftest",
                 "check a machine before its first calibration: axis senses, probe signs, clock, edge stamps",
                 "probebox selftest", selftest_);
    declareCalibrate(commands);
    declarePlan(commands);
    declareGcode(commands);
    declareInterference(commands);
  }

 private:
  static constexpr const char* kUsualMethod = "delay-multi-speed";

  void declareInterference(Subcommands& commands) {
    auto* check =
        commands.add("interference",
                     "move a tool with its measured lengths along a program and report the solids that it comes too "
                     "near; exit status 1 on a hit",
                     "probebox interference --cell cell.toml --tool 4 --gcode part.ngc", interference_);
    check->add_option("--cell", interference_.cell, "description of machine, fixture, workpiece and tools")
        ->required()
        ->check(fileName())
        ->type_name("FILE");
    check->add_option("--tool", interference_.tool, "number of its [[tool]]")
        ->required()
        ->check(wholeBetween(1, 99))
        ->type_name("NUMBER");
    check->add_option("--gcode", interference_.program, "the program; - is the standard input")
        ->required()
        ->check(fileName())
        ->type_name("FILE");
    check->add_option("--step", interference_.step_mm, "hits deeper than this are never missed")
        ->check(between(0.01, 10))
        ->type_name("MM")
        ->capture_default_str();
    check->add_flag("--stored", interference_.stored, "use the stored lengths instead of the measured ones");
  }

  void declareCalibrate(Subcommands& commands) {
    auto* calibrate =
        commands.add("calibrate", "run a calibration on the machine, step by step",
                     "probebox calibrate delay-multi-speed --save delay-today --accept --by Ada", calibrate_);
    calibrate->add_option("method", calibrate_.method, "one of " + methods_.all + "; default: " + kUsualMethod)
        ->check(anyName());
    addChoices(calibrate, calibrate_);
    calibrate
        ->add_option("--stations", calibrate_.stations,
                     "number of places at which the balls are read, at most as many as balls; removes the errors of "
                     "the linear axes "
                     "there; for " +
                         methods_.mounts)
        ->check(positive())
        ->type_name("NUMBER");
    calibrate
        ->add_option("--mounts", calibrate_.mounts,
                     "number of mounts in which the ball plate is read, up to 4; for " + methods_.mounts)
        ->check(CLI::Range(1, 4))
        ->type_name("NUMBER");
    calibrate
        ->add_option("--temperature", calibrate_.temperature_c,
                     "temperature of datum sphere and part during this run, -30 to 70; default: temperature_c of "
                     "machine.toml")
        ->check(between(kColdest_c, kWarmest_c))
        ->type_name("DEGREES_C");
    calibrate->add_option("--save", calibrate_.save, "also save the measured data as a case folder")->check(anyName());
    calibrate->add_flag("--accept", calibrate_.accept, "accept the result at once (needs --by)");
    calibrate->add_option("--by", calibrate_.by, "the name of the person who accepts")->check(personsName());
    calibrate->add_flag("--although-it-differs", calibrate_.although_it_differs,
                        "with --accept: even if the result differs from the one in force by more than 4 sd");
    calibrate->add_flag("--abort", calibrate_.abort, "abort the running calibration");
    calibrate->callback([this, &commands] {
      checkCalibrate(calibrate_);
      if (!calibrate_.abort && calibrate_.method.empty()) calibrate_.method = kUsualMethod;
      commands.request().job = calibrate_;
    });
  }

  void addChoices(CLI::App* command, RunChoices& choices) {
    constexpr std::uint64_t kMostCount = std::numeric_limits<std::uint16_t>::max();
    command->add_option("--speed", choices.speeds_mm_s, "speeds of the touches, such as 10,20,40")
        ->delimiter(',')
        ->check(positive())
        ->type_name("MM_PER_S");
    command->add_option("--overtravel", choices.overtravel_mm, "travel into the surface after contact")
        ->check(positive())
        ->type_name("MM");
    command->add_option("--clearance", choices.clearance_mm, "distance from the surface before and after a touch")
        ->check(positive())
        ->type_name("MM");
    command
        ->add_option("--approach", choices.approach_deg,
                     "angle between approach and surface normal; for " + methods_.approach)
        ->check(positive())
        ->type_name("DEGREES");
    command->add_option("--angles", choices.angles, "number of angles of C; for " + methods_.angles)
        ->check(wholeBetween(1, kMostCount))
        ->type_name("NUMBER");
    command->add_option("--arc", choices.arc_deg, "range of C; default: " + methods_.usual_arcs)
        ->check(positive())
        ->type_name("DEGREES");
    command->add_option("--heights", choices.balls, "number of balls at different heights; for " + methods_.heights)
        ->check(wholeBetween(1, kMostCount))
        ->type_name("NUMBER");
    command
        ->add_option("--axis", choices.axis,
                     "axis of the screw, X, Y or Z, for " + methods_.axis + "; rotary axis, B or C (default), for " +
                         methods_.rotary_axis)
        ->check(CLI::IsMember({"X", "Y", "Z", "B", "C"}, CLI::ignore_case))
        ->type_name("AXIS");
    command->add_option("--turns", choices.turns, "whole turns of the screw, 3 or more; for " + methods_.turns)
        ->check(wholeBetween(1, kMostCount))
        ->type_name("NUMBER");
    command
        ->add_option("--tool", choices.tool,
                     "number of the tool that is measured, for " + methods_.tool +
                         "; of the tool that carries the probe, for " + methods_.probe_tool)
        ->check(wholeBetween(1, std::numeric_limits<std::uint32_t>::max()))
        ->type_name("NUMBER");
    command->add_flag("--head", choices.head,
                      "measure with the sensor head instead of the probe, one position per ball; not on a box with a "
                      "touch-trigger probe; for " +
                          methods_.head);
    command->add_flag(
        "--shank", choices.shank,
        "measure with tip and shank of one stylus instead of tools of several lengths; for " + methods_.shank);
    command->add_flag(
        "--contacts", choices.contacts,
        "first find the zero of C: turn C until its ball touches the stylus, on either side of the line; for " +
            methods_.contacts);
  }

  void declarePlan(Subcommands& commands) {
    auto* plan = commands.add(
        "plan",
        "forecast the uncertainty of a calibration on the machine of the box that -u names, and find the best "
        "touches for a given time",
        "probebox plan delay-multi-speed --time 60", plan_);
    plan->add_option("method", plan_.method, "a method that calibrate runs")->required();
    addChoices(plan, plan_);
    plan->add_option("--machine", plan_.machine,
                     "machine.toml in the place of the machine of the box that -u names; default: that of the box, or "
                     "a usual one")
        ->check(fileName())
        ->type_name("FILE");
    plan->add_option("--probe", plan_.probe, "probe.toml in the place of the probe of that box")
        ->check(fileName())
        ->type_name("FILE");
    plan->add_option("--unit", plan_.unit, "unit.toml with the certificate of the datum sphere of that machine")
        ->needs("--machine")
        ->check(fileName())
        ->type_name("FILE");
    plan->add_option("--time", plan_.time_s, "time available: propose the most precise sets of touches for it")
        ->check(seconds())
        ->type_name("SECONDS");
    const auto add_number = [&](const char* name, std::optional<double>& value, double least, const char* what,
                                const char* unit) {
      constexpr double kMost = 1e6;
      plan->add_option(name, value, what)->check(between(least, kMost))->type_name(unit);
    };
    constexpr double kLeastRate_hz = 0.1, kLeastNoise_um = 1e-6, kLeastAcceleration_mm_s2 = 0.1;
    add_number("--machine-rate", plan_.machine_rate_hz, kLeastRate_hz,
               "rate of the positions; default: of the box, or 1000", "HZ");
    add_number("--machine-noise", plan_.machine_noise_um, kLeastNoise_um, "noise of one position, k = 1; default: 0.5",
               "UM");
    add_number("--probe-rate", plan_.probe_rate_hz, kLeastRate_hz,
               "rate of the deflections; default: of the box, or 2000", "HZ");
    add_number("--probe-noise", plan_.probe_noise_um, kLeastNoise_um,
               "noise of one channel, k = 1; default: of the box, or 0.4", "UM");
    add_number("--switch-noise", plan_.switch_noise_um, kLeastNoise_um,
               "plan with a touch-trigger probe: depth at which its switch opens, k = 1; default: the probe of the "
               "box, or a scanning one",
               "UM");
    add_number("--acceleration", plan_.acceleration_mm_s2, kLeastAcceleration_mm_s2,
               "acceleration of the machine; default: 10000", "MM_PER_S2");
  }

  void declareGcode(Subcommands& commands) {
    auto* gcode = commands.add(
        "gcode",
        "write the steps of a calibration as a program for a control that cannot read registers; with --loop, the "
        "program "
        "for all methods of a control that can",
        "probebox gcode delay-multi-speed --dialect fanuc --sphere 25 --stylus 6 --safe-z 80 -o delay.nc", gcode_);
    gcode->add_option("method", gcode_.method, "a method that calibrate runs; not with --loop");
    addChoices(gcode, gcode_);
    declareProgram(gcode, gcode_);
    gcode->callback([this, gcode, &commands] {
      checkGcode(gcode_);
      if (gcode_.loop) checkLoop(*gcode);
      commands.request().job = gcode_;
    });
  }

  // Refuses options about one method: the loop program serves all methods.
  static void checkLoop(const CLI::App& gcode) {
    constexpr std::array kTaken{"--loop", "--axes", "--dialect", "--number", "--frame", "--output", "--force"};
    for (const auto* given : gcode.get_options([](const CLI::Option* option) { return option->count() > 0; })) {
      const bool taken = std::ranges::any_of(kTaken, [&](const char* name) { return given->check_name(name); });
      if (!taken)
        throw CLI::ValidationError{given->get_name(),
                                   "is not for --loop: edit places in the program; the box itself decides about "
                                   "the run"};
    }
  }

  static void checkGcode(const Gcode& options) {
    if (options.loop && !options.method.empty())
      throw CLI::ValidationError{"--loop", "is one program for all methods, named when it is called: omit the method"};
    if (!options.loop && options.method.empty())
      throw CLI::ValidationError{"method", "is missing: name a method that calibrate runs, or give --loop"};
    if (options.frame && !options.loop) throw CLI::ValidationError{"--frame", "is for --loop"};
    if (options.axes.empty()) return;
    if (!options.loop) throw CLI::ValidationError{"--axes", "is for --loop"};
    std::string rest = options.axes;
    std::ranges::sort(rest);
    const bool once = std::ranges::adjacent_find(rest) == rest.end();
    if (!options.axes.starts_with("XYZ") || !once || rest.find_first_not_of("ABCXYZ") != std::string::npos)
      throw CLI::ValidationError{"--axes", "are XYZ, then those of A, B and C that the control has, such as XYZBC"};
  }

  static void checkCalibrate(const Calibrate& options) {
    if (options.abort && !options.method.empty()) {
      throw CLI::ValidationError{"calibrate", "--abort ends the running calibration; do not name a method"};
    }
    if (options.accept && options.by.empty()) {
      throw CLI::ValidationError{"--accept", "needs the name of the person who accepts: --by NAME"};
    }
  }

  const MethodHelp& methods_;
  Selftest selftest_;
  Calibrate calibrate_;
  Plan plan_;
  Gcode gcode_;
  Interference interference_;
};

}  // namespace probebox::command
