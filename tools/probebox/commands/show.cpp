#include <string>
#include <vector>

#include "tools/case/quantities.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"

namespace probebox::command {
namespace {

using Transitions = std::vector<messages::ResultTransition>;

void showObject(const KeptResult& kept, const Transitions& history, Console& console) {
  Json object{{"id", kept.summary.id}};
  object.update(describe(kept.summary));
  object["standing"] = standingOf(kept.summary);
  if (kept.result() != nullptr) {
    object.update(describe(*kept.result(), casefolder::rotaryAxisOf(kept.summary.subject)));
  } else {
    object.update(describe(*kept.refusal()));
  }
  object["dataset_kept"] = kept.dataset_kept;
  object["history"] = Json::array();
  for (const auto& transition : history) object["history"].push_back(describe(transition));
  console.object(object);
}

void showPage(const KeptResult& kept, const Transitions& history, Console& console) {
  const auto number = std::to_string(kept.summary.id);
  console.line(headOf(kept.summary));
  if (kept.result() != nullptr) {
    console.line(page(*kept.result(), kept.summary.subject));
  } else {
    console.line("refused: " + kept.refusal()->name + "\n  " + kept.refusal()->reason);
  }
  console.line("history");
  for (const auto& transition : history) console.line("  " + line(transition));
  console.line(kept.dataset_kept ? "its dataset is kept: probebox report " + number + " -o result-" + number + ".html"
               : kept.isSum()    ? "it is the sum of two results: the datasets are those of the results it rests on"
                                 : "its dataset is no longer kept");
}

}  // namespace

ExitStatus run(const Show& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  auto kept = keptResult(**box, console, options.id);
  if (!kept) return console.fail(kept.error());
  // The list knows what a result rests on now, and who said that its case was measured here; refusals are not in it.
  const auto listed = storedResults(**box, console, {.after_id = options.id - 1, .newest = 0}, 1);
  if (!listed) return console.fail(listed.error());
  if (!listed->empty() && listed->front().id == options.id) {
    kept->summary.rests_on = listed->front().rests_on;
    kept->summary.as_this_machine_by = listed->front().as_this_machine_by;
  }
  const auto history = storedTransitions(**box, console, {options.id, "", 0});
  if (!history) return console.fail(history.error());
  if (console.json()) {
    showObject(*kept, *history, console);
  } else {
    showPage(*kept, *history, console);
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
