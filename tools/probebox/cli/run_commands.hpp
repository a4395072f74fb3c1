#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/tolerances.hpp"
#include "tools/probebox/cli/method_help.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/cli/subcommands.hpp"
#include "tools/probebox/cli/validators.hpp"

namespace probebox::command {

inline constexpr double kFurthest_mm = 100'000;

// A point in mm, such as "10,-20.5,30".
inline CLI::Validator point() {
  const auto check = [](std::string& text) {
    std::size_t numbers = 0;
    bool good = true;
    for (std::size_t from = 0; from <= text.size(); ++numbers) {
      const std::size_t comma = std::min(text.find(',', from), text.size());
      double value = 0;
      good = good && readsAs(text.substr(from, comma - from), value) && std::abs(value) <= kFurthest_mm;
      from = comma + 1;
    }
    return good && numbers == 3 ? std::string{} : text + " is not a point in mm, such as 10,-20.5,30";
  };
  return CLI::Validator{check, "", "point"};
}

// A word of a control for the angle of an axis, such as "A=M19 R", of characters that a program may hold.
inline CLI::Validator axisWord() {
  const auto check = [](std::string& text) {
    constexpr std::size_t kLongest = 14;
    const auto usual = [](unsigned char c) {
      return std::isupper(c) != 0 || std::isdigit(c) != 0 || c == ' ' || c == '=';
    };
    const bool named = text.size() > 2 && text.size() <= kLongest && text[0] >= 'A' && text[0] <= 'C' && text[1] == '=';
    const std::string word = named ? text.substr(2) : std::string{};
    const bool good = named && std::string_view{"ABCUVWMS"}.find(word.front()) != std::string_view::npos &&
                      std::ranges::all_of(word, usual) && (std::isupper(word.back()) != 0 || word.back() == '=');
    return good ? std::string{} : text + " is not a word for A, B or C, such as A=M19 R, A=SPOS= or B=A";
  };
  return CLI::Validator{check, "", "word"};
}

// Declares the options of `gcode` that describe the machine. Only run_commands.hpp includes this.
inline void declareProgram(CLI::App* gcode, Gcode& options) {
  const auto add_point = [&](const char* name, std::vector<double>& value, const char* what) {
    gcode->add_option(name, value, what)
        ->delimiter(',')
        ->expected(3)
        ->check(between(-kFurthest_mm, kFurthest_mm))
        ->type_name("X,Y,Z");
  };
  const auto add_mm = [&](const char* name, auto& value, const char* what) {
    constexpr double kLeast_mm = 1e-3;  // decimals of a program
    gcode->add_option(name, value, what)->check(between(kLeast_mm, kFurthest_mm))->type_name("MM");
  };
  const auto add_feed = [&](const char* name, auto& value, const char* what) {
    gcode->add_option(name, value, what)->check(between(1, 100'000))->type_name("MM_PER_MIN");
  };
  gcode->add_option("--dialect", options.dialect, "dialect of the control")
      ->check(CLI::IsMember({"linuxcnc", "fanuc", "fanuc-lathe", "siemens", "siemens-lathe", "haas"}))
      ->required();
  gcode
      ->add_option("-o,--output", options.output,
                   "the program to write, or its picture: NAME.svg; - is the standard output")
      ->required();
  gcode->add_option("--picture", options.picture, "also write the path as a picture, SVG")
      ->check(fileName())
      ->type_name("FILE");
  gcode->add_flag(
      "--stops", options.stops,
      "stop before and after each step, for a person who presses Enter at `probebox calibrate`; default: the "
      "control prints a line to the box's tape: face");
  gcode
      ->add_option("--tape", options.tape,
                   "serial line to the box as the control names it, for linuxcnc; default: /dev/ttyS1")
      ->check(device())
      ->type_name("DEVICE");
  gcode->add_flag("--loop", options.loop,
                  "the program that reads each step from the box's registers, for fanuc and siemens; its places are "
                  "edited in it");
  gcode
      ->add_option("--axes", options.axes,
                   "with --loop: axes as the control numbers them; default: XYZABC, of a lathe XZC")
      ->type_name("LETTERS");
  gcode
      ->add_option(
          "--frame", options.frame,
          "with --loop for fanuc: P of G54.1, the work offset that the program moves in; 0: G59; default: 48, of "
          "a lathe 0")
      ->check(wholeBetween(0, 48))
      ->type_name("NUMBER");
  gcode->add_flag("--force", options.force, "overwrite existing files");
  gcode->add_option("--safe-z", options.safe_z_mm, "height above everything, in the work offset")
      ->check(between(-kFurthest_mm, kFurthest_mm))
      ->type_name("MM");
  add_point("--at", options.at_mm, "centre of sphere, gap, bore, cube or setter in the work offset; default: 0,0,0");
  gcode->add_option("--ball", options.balls_mm, "where a ball of the part is at C = 0; once for each ball")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(point())
      ->type_name("X,Y,Z");
  add_point("--c-axis", options.c_axis_mm, "a point of the turning axis C, which is along Z; default: 0,0,0");
  add_point("--table-axis", options.table_axis_mm, "a point of the axis of a tilting table");
  gcode->add_option("--b-axis", options.b_axis, "axis about which B turns right-handed, X, Y, -X or -Y; default: X")
      ->check(CLI::IsMember({"X", "Y", "-X", "-Y"}));
  gcode
      ->add_option("--words", options.words,
                   "words of the control for the box's axes A (orientation of the spindle), B and C; default: M19 R or "
                   "SPOS= for A, A for a B about X, else B and C")
      ->delimiter(',')
      ->check(axisWord())
      ->type_name("AXIS=WORD");
  gcode->add_option("--tilts", options.tilts_deg, "angles of B, as tilts_deg of machine.toml has them")
      ->delimiter(',')
      ->check(between(-360, 360))
      ->type_name("DEGREES");
  gcode
      ->add_option("--probe-tools", options.probe_tools,
                   "tools that carry the probe, as machine.toml numbers them; the program takes them with their length "
                   "offsets. Without: the probe is in the spindle, and the program ends unless an offset is active")
      ->delimiter(',')
      ->check(wholeNumber())
      ->type_name("NUMBERS");
  gcode->add_option("--head-tool", options.head_tool, "tool number of the sensor head")
      ->check(wholeNumber())
      ->type_name("NUMBER");
  add_mm("--sphere", options.sphere_mm, "diameter of the sphere or ball");
  add_mm("--gap", options.gap_mm, "distance of the plates");
  add_mm("--bore", options.bore_mm, "diameter of the bore");
  add_point("--cube", options.cube_mm, "edges of the cube along X, Y, Z");
  add_mm("--setter", options.setter_mm, "width of the tool-setting device");
  add_mm("--stylus", options.stylus_mm, "diameter of the stylus ball");
  add_mm("--tool-diameter", options.tool_diameter_mm, "diameter of the tool that is measured");
  add_mm("--deflection-limit", options.deflection_limit_mm,
         "deflection_limit_mm of probe.toml: a larger --overtravel is refused; default: 1");
  gcode
      ->add_option("--machine-z", options.machine_z_mm,
                   "machine position of Z to which it rises before a tool is taken; default: 0; not for fanuc-lathe, "
                   "which goes to the reference point")
      ->check(between(-kFurthest_mm, kFurthest_mm))
      ->type_name("MM");
  gcode
      ->add_option("--number", options.number,
                   "number of the program, for fanuc and haas; default: 1000, "
                   "with --loop the first of 50: 8700")
      ->check(wholeBetween(1, 8999))
      ->type_name("NUMBER");
  gcode->add_flag("--no-skip", options.no_skip,
                  "the probe is not wired to the control's skip input: write moves that it cannot stop");
  gcode->add_flag("--no-orient", options.no_orient,
                  "do not orient the spindle where the method does not turn it: it cannot turn, or does not hold the "
                  "probe");
  add_feed("--traverse", options.traverse_mm_min, "feed of traverses; default: 1500");
  add_feed("--most-feed", options.most_mm_min, "limit of all feeds; default: 6000");
}

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
        ->add_option(
            "--mounts", calibrate_.mounts,
            "number of mounts in which the ball plate is read, or of clampings of the ball of centreline-x, up to "
            "4; default: the method's own; for " +
                methods_.mounts)
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
      if (calibrate_.accept) checkPerson(commands.request(), calibrate_.by, "--accept");
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
                     "axis of the screw, X, Y or Z, for " + methods_.screw + "; across which the faces stand, for " +
                         methods_.faces + " (default: the first that has plates); rotary axis, B or C (default), for " +
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
    command
        ->add_option("--spindle", choices.spindle,
                     "1 the main chuck (default), 2 the second one; for " + methods_.spindle)
        ->check(CLI::Range(1, 2))
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
  }

  static void checkCalibrate(const Calibrate& options) {
    if (options.abort && !options.method.empty()) {
      throw CLI::ValidationError{"calibrate", "--abort ends the running calibration; do not name a method"};
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
