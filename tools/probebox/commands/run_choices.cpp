#include "tools/probebox/commands/run_choices.hpp"

#include <algorithm>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/nearest.hpp"
#include "tools/probebox/commands/axis_number.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {

Outcome<const procedure::LiveMethod*, Trouble> methodOf(const RunChoices& choices) {
  const procedure::LiveMethod* method = procedure::methodNamed(choices.method);
  if (method == nullptr) {
    std::string known;
    for (const auto name : procedure::methodNames()) known += (known.empty() ? "" : ", ") + std::string{name};
    return usage("no box runs " + choices.method + didYouMean(choices.method, procedure::methodNames()) +
                 "; use one of: " + known);
  }
  if (choices.speeds_mm_s.size() > kMostSpeeds)
    return usage("a run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some");
  return method;
}

plan::Wanted wantedOf(const procedure::LiveMethod& method, const RunChoices& options) {
  plan::Wanted wanted{.method = &method};
  auto& chosen = wanted.options;
  chosen.speed_count = static_cast<std::uint8_t>(options.speeds_mm_s.size());
  std::ranges::copy(options.speeds_mm_s, chosen.speeds_mm_s.begin());
  chosen.overtravel_mm = options.overtravel_mm.value_or(0);
  chosen.clearance_mm = options.clearance_mm.value_or(0);
  chosen.approach_rad = options.approach_deg.value_or(0) * kDegree;
  chosen.arc_rad = options.arc_deg.value_or(0) * kDegree;
  chosen.angles = options.angles.value_or(0);
  chosen.balls = options.balls.value_or(0);
  chosen.axis = axisNumber(options.axis);
  chosen.tool = options.tool.value_or(0);
  wanted.turns = options.turns.value_or(0);
  if (options.head) wanted.by = procedure::ReadBy::head;
  if (options.shank) wanted.by = procedure::ReadBy::shank;
  return wanted;
}

std::string chosenOf(const plan::Wanted& wanted) {
  std::string text;
  const auto& [method, options, turns, by] = wanted;
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
  add_number("--turns", turns);
  add_number("--tool", options.tool);
  if (by == procedure::ReadBy::head) add("--head");
  if (by == procedure::ReadBy::shank) add("--shank");
  return text;
}

}  // namespace probebox::command
