#include <string>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"

namespace probebox::command {
namespace {

void showPage(const ResultWithHistory& result, Console& console) {
  const auto& kept = result.kept;
  const auto number = std::to_string(kept.summary.id);
  console.line(headOf(kept.summary));
  if (kept.result() != nullptr) {
    console.line(page(*kept.result(), kept.summary.subject));
  } else {
    console.line("refused: " + kept.refusal()->name + "\n  " + kept.refusal()->reason);
  }
  console.line("history");
  for (const auto& transition : result.history) console.line("  " + line(transition));
  console.line(kept.dataset_kept ? "its dataset is kept: probebox report " + number + " -o result-" + number + ".html"
               : kept.isSum()    ? "it is the sum of two results: the datasets are those of the results it rests on"
                                 : "its dataset is no longer kept");
}

}  // namespace

ExitStatus run(const Show& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto result = resultWithHistory(**box, console, options.id);
  if (!result) return console.fail(result.error());
  if (console.json()) {
    console.object(describe(*result));
  } else {
    showPage(*result, console);
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
