#include <string>
#include <vector>

#include "tools/probebox/cli/json_of.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// To end one's own is right where one holds none, but seldom what was meant.
void sayWhoseIsLeft(const Inhibit& options, const std::vector<messages::InhibitHolder>& holders, Console& console) {
  if (options.what != "off" || holders.empty()) return;
  console.note((options.by.empty() ? "this link" : options.by) +
               " holds no inhibit now; to end another's: probebox inhibit off --connection '" +
               holders.front().connection + "' --by NAME");
}

}  // namespace

// Says who holds an inhibit, after having set or ended one.
ExitStatus run(const Inhibit& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  if (!options.what.empty()) {
    const auto done = ask<messages::SetInhibit>(**box, console, {options.what == "on", options.by, options.connection});
    if (!done) return console.fail(done.error());
  }
  const auto status = ask<messages::Status>(**box, console);
  if (!status) return console.fail(status.error());
  const auto corrections = ask<messages::Corrections>(**box, console);
  if (!corrections) return console.fail(corrections.error());
  if (console.json()) {
    console.object({{"inhibits", jsonOf(status->inhibits)}, {"cut_in_progress", corrections->inhibited}});
    return ExitStatus::ok;
  }
  sayWhoseIsLeft(options, status->inhibits, console);
  if (status->inhibits.empty())
    console.line(corrections->inhibited ? cutLine() : "nobody holds an inhibit, and no inhibit line is active");
  for (const auto& holder : status->inhibits) console.line("a cut is on: " + line(holder));
  return ExitStatus::ok;
}

}  // namespace probebox::command
