#include "tools/probebox/commands/run_choices.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/nearest.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// Returns 1 to 6 for X, Y, Z, A, B, C; 0 for an empty name.
std::uint8_t axisNumber(const std::string& name) {
  if (name.empty()) return 0;
  const int letter = std::toupper(static_cast<unsigned char>(name.front()));
  return static_cast<std::uint8_t>(letter < 'X' ? letter - 'A' + 4 : letter - 'X' + 1);
}

}  // namespace

Outcome<ProcedureOptions, Trouble> optionsOf(const RunChoices& choices) {
  if (choices.speeds_mm_s.size() > kMostSpeeds)
    return usage("a run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some");
  ProcedureOptions options;
  options.speed_count = static_cast<std::uint8_t>(choices.speeds_mm_s.size());
  std::ranges::copy(choices.speeds_mm_s, options.speeds_mm_s.begin());
  options.overtravel_mm = choices.overtravel_mm.value_or(0);
  options.clearance_mm = choices.clearance_mm.value_or(0);
  options.approach_rad = radians(choices.approach_deg.value_or(0));
  options.arc_rad = radians(choices.arc_deg.value_or(0));
  options.angles = choices.angles.value_or(0);
  options.balls = choices.balls.value_or(0);
  options.axis = axisNumber(choices.axis);
  options.turns = choices.turns.value_or(0);
  options.tool = choices.tool.value_or(0);
  options.head = choices.head;
  options.shank = choices.shank;
  options.spindle = choices.spindle.value_or(0);
  options.contacts = choices.contacts;
  return options;
}

Outcome<plan::Wanted, Trouble> wantedOf(const RunChoices& choices) {
  const procedure::LiveMethod* method = procedure::methodNamed(choices.method);
  if (method == nullptr) {
    std::string known;
    for (const auto name : procedure::methodNames()) known += (known.empty() ? "" : ", ") + std::string{name};
    return usage("no box runs " + choices.method + didYouMean(choices.method, procedure::methodNames()) +
                 "; use one of: " + known);
  }
  TRY(const auto options, optionsOf(choices));
  return plan::Wanted{.method = method, .options = options};
}

std::string chosenOf(const plan::Wanted& wanted) {
  std::string text;
  const auto& options = wanted.options;
  for (std::size_t i = 0; i < options.speed_count; ++i)
    text += printed("%s%g", i == 0 ? "--speed " : ",", options.speeds_mm_s[i]);
  const auto add = [&](const std::string& words) { text += (text.empty() ? "" : " ") + words; };
  const auto add_number = [&](const char* flag, double value) {
    if (value != 0) add(printed("%s %g", flag, value));
  };
  add_number("--overtravel", options.overtravel_mm);
  add_number("--clearance", options.clearance_mm);
  add_number("--approach", degrees(options.approach_rad));
  add_number("--arc", degrees(options.arc_rad));
  add_number("--angles", options.angles);
  add_number("--heights", options.balls);
  if (options.axis != 0) add(std::string{"--axis "} + "XYZABC"[options.axis - 1]);
  add_number("--turns", options.turns);
  add_number("--tool", options.tool);
  if (options.head) add("--head");
  if (options.shank) add("--shank");
  add_number("--spindle", options.spindle);
  if (options.contacts) add("--contacts");
  return text;
}

}  // namespace probebox::command
