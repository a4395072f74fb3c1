#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"
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
  unsigned mask = 0;
  if (names == "none") return std::uint16_t{0};
  for (std::size_t at = 0; at <= names.size();) {
    const auto name = std::string_view{names}.substr(at, names.find(',', at) - at);
    const auto found = std::ranges::find(kSources, name, &SourceDescription::name);
    if (found == std::end(kSources)) return std::nullopt;
    mask |= 1U << static_cast<unsigned>(found - std::begin(kSources));
    at += name.size() + 1;
  }
  return static_cast<std::uint16_t>(mask);
}

// What "B=30,tool=4,length=120.5" says; which part of another text is wrong.
class Told {
 public:
  Outcome<messages::TellPose::Request, Trouble> read(const std::string& text) {
    for (std::size_t at = 0; at <= text.size();) {
      const auto part = std::string_view{text}.substr(at, text.find(',', at) - at);
      at += part.size() + 1;
      if (const auto wrong = whyNot(part); !wrong.empty())
        return Trouble{ExitStatus::usage, "usage",
                       "--tell " + text + ": '" + std::string{part} + "' " + wrong +
                           "; write angles in degrees, the tool's number and, with it, its length in mm, such as "
                           "B=30,tool=4,length=120"};
    }
    // A length belongs to a tool.
    if (pose_.tool_length_mm > 0 && !pose_.has_tool)
      return Trouble{ExitStatus::usage, "usage", "--tell " + text + " has a length without its tool: add tool=NUMBER"};
    return pose_;
  }

 private:
  // Empty for a part that is right.
  std::string whyNot(std::string_view part) {
    constexpr std::string_view kLetters = "ABC";
    const auto equals = part.find('=');
    if (equals == std::string_view::npos) return "has no value";
    const auto name = part.substr(0, equals), number = part.substr(equals + 1);
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc{} || end != number.data() + number.size() || !std::isfinite(value)) return "is no number";
    const auto axis = name.size() == 1 ? kLetters.find(name) : std::string_view::npos;
    if (axis != std::string_view::npos) return takeAngle(axis, value);
    if (name == "tool") return takeTool(value);
    if (name != "length") return "names nothing that can be told";
    if (pose_.tool_length_mm > 0) return "comes twice";
    if (!(value > 0 && value <= kMostToolLength_mm)) return "is no length from 0 to 2000 mm";
    pose_.tool_length_mm = value;
    return {};
  }
  std::string takeAngle(std::size_t axis, double degrees) {
    const unsigned bit = 1U << axis;
    if ((pose_.axes & bit) != 0) return "comes twice";
    if (std::abs(degrees) > kMostTurn_deg) return "is no angle from -3600 to 3600 degrees";
    pose_.axes = static_cast<std::uint8_t>(pose_.axes | bit);
    pose_.angles_rad[axis] = radians(degrees);
    return {};
  }
  std::string takeTool(double number) {
    if (pose_.has_tool) return "comes twice";
    if (!(number >= 0 && number <= 65'535 && number == std::floor(number))) return "is no tool from 0 to 65535";
    pose_.has_tool = true;
    pose_.tool = static_cast<std::uint32_t>(number);
    return {};
  }

  messages::TellPose::Request pose_;
};

// The box takes the mask at a tick and shows it a moment later.
Outcome<messages::Corrections::Answer, Trouble> correctionsWith(std::optional<std::uint16_t> mask, link::Client& box,
                                                                Console& console) {
  constexpr Nanoseconds kPatience = std::chrono::seconds{2};
  const auto begun = link::now();
  for (;;) {
    auto corrections = ask<messages::Corrections>(box, console);
    const bool shown = !corrections || !mask || corrections->mask == *mask;
    if (shown || link::now() - begun > kPatience || !goRound(box, console)) return corrections;
  }
}

}  // namespace

ExitStatus run(const Corrections& options, const std::string& uri, Console& console) {
  std::optional<std::uint16_t> mask;
  if (options.sum && !(mask = maskOf(*options.sum)))
    return console.fail(
        {ExitStatus::usage, "usage", "--sum " + *options.sum + ": name screw, swivel, rotary, centreline, or none"});
  const auto pose = options.tell ? Told{}.read(*options.tell) : messages::TellPose::Request{};
  if (!pose) return console.fail(pose.error());
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  if (mask) {
    const auto enabled = ask<messages::EnableSources>(**box, console, {*mask});
    if (!enabled) return console.fail(enabled.error());
  }
  if (options.tell) {
    const auto told = ask<messages::TellPose>(**box, console, *pose);
    if (!told) return console.fail(told.error());
  }
  Pace pace{options.until, kPeriod};
  const bool follow = options.follow || options.until.count || options.until.seconds;
  do {
    if (pace.due()) {
      const auto corrections = correctionsWith(mask, **box, console);
      if (!corrections) return console.fail(corrections.error());
      mask.reset();
      show(*corrections, follow, console);
    }
  } while (follow && !pace.over() && goRound(**box, console));
  return ended(**box, console);
}

}  // namespace probebox::command
