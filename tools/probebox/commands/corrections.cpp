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
    console.line(line(corrections));
  }
}

}  // namespace

ExitStatus run(const Corrections& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
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
