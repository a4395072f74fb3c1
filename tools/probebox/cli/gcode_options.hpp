#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "tools/probebox/cli/request.hpp"
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
      ->check(CLI::IsMember({"linuxcnc", "fanuc", "siemens", "haas"}))
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
  gcode->add_option("--axes", options.axes, "with --loop: axes as the control numbers them; default: XYZABC")
      ->type_name("LETTERS");
  gcode
      ->add_option("--frame", options.frame,
                   "with --loop for fanuc: P of G54.1, the work offset that the program moves in; 0: G59; default: 48")
      ->check(wholeBetween(0, 48))
      ->type_name("NUMBER");
  gcode->add_flag("--force", options.force, "overwrite existing files");
  gcode->add_option("--safe-z", options.safe_z_mm, "height above everything, in the work offset")
      ->check(between(-kFurthest_mm, kFurthest_mm))
      ->type_name("MM");
  add_point("--at", options.at_mm, "centre of sphere, gap or setter in the work offset; default: 0,0,0");
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
  add_mm("--setter", options.setter_mm, "width of the tool-setting device");
  add_mm("--stylus", options.stylus_mm, "diameter of the stylus ball");
  add_mm("--tool-diameter", options.tool_diameter_mm, "diameter of the tool that is measured");
  add_mm("--deflection-limit", options.deflection_limit_mm,
         "deflection_limit_mm of probe.toml: a larger --overtravel is refused; default: 1");
  gcode
      ->add_option("--machine-z", options.machine_z_mm,
                   "machine position of Z to which it rises before a tool is taken; default: 0")
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

}  // namespace probebox::command
