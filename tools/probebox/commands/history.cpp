#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/result_number.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

void show(const messages::ResultTransition& transition, Console& console) {
  if (console.json()) {
    console.object(describe(transition));
  } else {
    console.line(line(transition));
  }
}

}  // namespace

ExitStatus run(const History& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto id = resultNumber(options.what);
  messages::ResultHistory::Request request{id.value_or(0), id ? "" : options.what, 0};
  bool more = true, nothing = true;
  ListWatch watch;
  while (more && console.writable()) {
    const auto history = ask<messages::ResultHistory>(**box, console, request);
    if (!history) return console.fail(history.error());
    if (const auto& all = history->transitions; !all.empty()) {
      if (const auto trouble = watch.part(all.front().number, all.back().number)) return console.fail(*trouble);
    }
    for (const auto& transition : history->transitions) show(transition, console);
    nothing = nothing && history->transitions.empty();
    more = history->more && !history->transitions.empty();
    if (more) request.after_number = history->transitions.back().number;
  }
  if (nothing && !options.what.empty()) {
    const auto meant = subjectMeant(options.what, **box, console);
    return console.fail(Trouble{
        ExitStatus::failed, "not_found",
        "no result about " + options.what + " is stored" + (meant.empty() ? "; probebox history lists all" : meant)});
  }
  if (nothing) console.note("no result is stored");
  return ExitStatus::ok;
}

}  // namespace probebox::command
