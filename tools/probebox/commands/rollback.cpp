#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/result_number.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/stored_results.hpp"

namespace probebox::command {
namespace {

std::string inWords(const messages::RollbackResult::Answer& answer, const std::string& by) {
  const auto which = [](std::uint64_t id) { return "result " + std::to_string(id); };
  if (answer.withdrawn) return which(answer.retired_id) + " will not come into force, withdrawn by " + by;
  const std::string retired = answer.retired_id == 0 ? "" : which(answer.retired_id) + " is retired by " + by + "; ";
  return retired + (answer.active_id == 0 ? "no result about " + answer.subject + " is in force any more"
                                          : which(answer.active_id) + " is in force again");
}

}  // namespace

ExitStatus run(const Rollback& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto id = resultNumber(options.what);
  const auto by = signer(options.by, uri);
  auto rolled_back = ask<messages::RollbackResult>(**box, console, {id.value_or(0), id ? "" : options.what, by});
  if (!rolled_back && rolled_back.error().status == ExitStatus::box_refused && !id) {
    const auto subject = subjectOfMethod(options.what, **box, console);
    if (!subject) return console.fail(subject.error());
    if (*subject && **subject != options.what)
      rolled_back = ask<messages::RollbackResult>(**box, console, {0, **subject, by});
  }
  if (!rolled_back) {
    auto trouble = rolled_back.error();
    if (trouble.status == ExitStatus::box_refused && !id) trouble.what += subjectMeant(options.what, **box, console);
    return console.fail(trouble);
  }
  if (console.json()) {
    console.object({{"subject", rolled_back->subject},
                    {"retired_id", rolled_back->retired_id},
                    {"active_id", rolled_back->active_id},
                    {"withdrawn", rolled_back->withdrawn},
                    {"by", by},
                    {"notes", rolled_back->notes}});
  } else {
    console.line(inWords(*rolled_back, by));
    for (const auto& note : rolled_back->notes) console.line("  " + note);
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
