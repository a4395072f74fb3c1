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

// Whether there is any; shows each as it comes.
Outcome<bool, Trouble> showAll(messages::ResultHistory::Request request, link::Client& box, Console& console) {
  bool more = true, any = false;
  ListWatch watch;
  while (more && console.writable()) {
    TRY(const auto history, ask<messages::ResultHistory>(box, console, request));
    if (const auto& all = history.transitions; !all.empty()) {
      if (const auto trouble = watch.part(all.front().number, all.back().number)) return *trouble;
    }
    for (const auto& transition : history.transitions) show(transition, console);
    any = any || !history.transitions.empty();
    more = history.more && !history.transitions.empty();
    if (more) request.after_number = history.transitions.back().number;
  }
  return any;
}

// Of a method whose results name their subject, such as rotary-b.
Outcome<bool, Trouble> showOfMethod(const std::string& method, link::Client& box, Console& console) {
  TRY(const auto subject, subjectOfMethod(method, box, console));
  if (!subject || *subject == method) return false;
  return showAll({.id = 0, .subject = *subject, .after_number = 0}, box, console);
}

}  // namespace

ExitStatus run(const History& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto id = resultNumber(options.what);
  auto any = showAll({id.value_or(0), id ? "" : options.what, 0}, **box, console);
  if (any && !*any && !id && !options.what.empty()) any = showOfMethod(options.what, **box, console);
  if (!any) return console.fail(any.error());
  if (*any) return ExitStatus::ok;
  if (!options.what.empty()) {
    const auto meant = subjectMeant(options.what, **box, console);
    return console.fail(
        {ExitStatus::failed, "not_found",
         "no result about " + options.what + " is stored" + (meant.empty() ? "; probebox history lists all" : meant)});
  }
  if (console.json()) console.object({{"transitions", Json::array()}});
  console.note("no result is stored");
  return ExitStatus::ok;
}

}  // namespace probebox::command
