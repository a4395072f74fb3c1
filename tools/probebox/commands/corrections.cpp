#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/pace.hpp"
#include "tools/probebox/report.hpp"

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

}  // namespace

ExitStatus run(const Corrections& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  if (!options.sum.empty()) {
    const auto mask = maskOf(options.sum);
    if (!mask)
      return console.fail({ExitStatus::usage, "usage", "--sum " + options.sum + ": name screw, centreline, or none"});
    const auto enabled = ask<messages::EnableSources>(**box, console, {*mask});
    if (!enabled) return console.fail(enabled.error());
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
