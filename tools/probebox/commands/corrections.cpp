#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "protocol/units/angle.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/pace.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kPeriod{200};

void show(const messages::Corrections::Answer& corrections, bool again, Console& console) {
  if (console.json()) {
    console.object(describe(corrections));
  } else if (again) {
    console.live(line(corrections));
  } else {
    console.line(page(corrections));
  }
}

// "screw,centreline" or "none"; nothing when a name is not known.
std::optional<std::uint16_t> maskOf(const std::string& names) {
  constexpr std::array<std::string_view, 4> kSources{"screw", "swivel", "rotary", "centreline"};
  unsigned mask = 0;
  if (names == "none") return std::uint16_t{0};
  for (std::size_t at = 0; at <= names.size();) {
    const auto name = std::string_view{names}.substr(at, names.find(',', at) - at);
    const auto found = std::ranges::find(kSources, name);
    if (found == kSources.end()) return std::nullopt;
    mask |= 1U << static_cast<unsigned>(found - kSources.begin());
    at += name.size() + 1;
  }
  return static_cast<std::uint16_t>(mask);
}

// "B=30,tool=4,length=120.5"; nothing when it says something else.
std::optional<messages::TellPose::Request> poseOf(const std::string& text) {
  constexpr std::string_view kLetters = "ABC";
  messages::TellPose::Request pose;
  for (std::size_t at = 0; at <= text.size();) {
    const auto part = std::string_view{text}.substr(at, text.find(',', at) - at);
    at += part.size() + 1;
    const auto equals = part.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    const auto name = part.substr(0, equals), number = part.substr(equals + 1);
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc{} || end != number.data() + number.size() || !std::isfinite(value)) return std::nullopt;
    const auto axis = name.size() == 1 ? kLetters.find(name) : std::string_view::npos;
    if (axis != std::string_view::npos) {
      pose.axes = static_cast<std::uint8_t>(pose.axes | 1U << axis);
      pose.angles_rad[axis] = radians(value);
    } else if (name == "tool" && value >= 0 && value <= 65'535 && value == std::floor(value)) {
      pose.has_tool = true;
      pose.tool = static_cast<std::uint32_t>(value);
    } else if (name == "length" && value > 0) {
      pose.tool_length_mm = value;
    } else {
      return std::nullopt;
    }
  }
  // A length belongs to a tool.
  if (pose.tool_length_mm > 0 && !pose.has_tool) return std::nullopt;
  return pose;
}

}  // namespace

ExitStatus run(const Corrections& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  if (!options.sum.empty()) {
    const auto mask = maskOf(options.sum);
    if (!mask)
      return console.fail(
          {ExitStatus::usage, "usage", "--sum " + options.sum + ": name screw, swivel, rotary, centreline, or none"});
    const auto enabled = ask<messages::EnableSources>(**box, console, {*mask});
    if (!enabled) return console.fail(enabled.error());
  }
  if (!options.tell.empty()) {
    const auto pose = poseOf(options.tell);
    if (!pose)
      return console.fail({ExitStatus::usage, "usage",
                           "--tell " + options.tell +
                               ": write angles in degrees, the tool's number and, with it, its "
                               "length in mm, such as B=30,tool=4,length=120"});
    const auto told = ask<messages::TellPose>(**box, console, *pose);
    if (!told) return console.fail(told.error());
  }
  Pace pace{options.until, kPeriod};
  const bool follow = options.follow || options.until.count || options.until.seconds;
  do {
    if (pace.due()) {
      const auto corrections = ask<messages::Corrections>(**box, console);
      if (!corrections) return console.fail(corrections.error());
      show(*corrections, follow, console);
    }
  } while (follow && !pace.over() && goRound(**box, console));
  return ended(**box, console);
}

}  // namespace probebox::command
