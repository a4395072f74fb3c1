#include "tools/report/page.hpp"

#include "tools/report/change.hpp"
#include "tools/report/conformity.hpp"
#include "tools/report/decision.hpp"
#include "tools/report/document_head.hpp"
#include "tools/report/html.hpp"
#include "tools/report/pictures.hpp"
#include "tools/report/sections.hpp"
#include "tools/report/values.hpp"

namespace probebox::report {
namespace {

std::string picturesOf(const Subject& subject) {
  auto plots = pictures(subject);
  if (auto trend = trendPicture(subject)) plots.insert(plots.begin(), *std::move(trend));
  if (plots.empty()) return {};
  std::string text = "<h2>Pictures</h2>\n<div class=\"pictures\">\n";
  for (const auto& plot : plots) text += plot.svg();
  return text + "</div>\n";
}

std::string article(const Subject& subject) {
  std::string text = "<article>\n" + heading(subject) + decisionBox(subject, changeLines(subject));
  if (const auto* result = subject.result()) {
    text += warningsList(*result) + changeTable(subject) + conformityTable(subject) + valueTables(subject) +
            standardsTable(subject) + picturesOf(subject) + residualsTable(*result) + droppedList(*result) +
            budgetTable(*result) + factsTable(*result) + unobservableList(subject) + alsoTable(subject);
  } else {
    text += picturesOf(subject);
  }
  return text + conditionsTable(subject) + "</article>\n";
}

}  // namespace

std::string page(std::span<const Subject> subjects, const std::string& version) {
  std::string title = "probebox report";
  if (subjects.size() == 1) title += ": " + subjects.front().name;
  std::string text = documentHead(title);
  for (const auto& subject : subjects) text += article(subject);
  return text + "<p class=\"small\">probebox " + escaped(version) +
         "; equations as numbered in docs/metrology.md; sd is one standard deviation (k = 1) of readings and stops of "
         "axes, U = 2 u "
         "(k = 2, "
         "about 95 %), u the combined standard uncertainty with type B, which commands print after "
         "+/-.</p>\n</body>\n</html>\n";
}

}  // namespace probebox::report
