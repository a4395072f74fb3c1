#include "tools/report/page.hpp"

#include "tools/report/html.hpp"
#include "tools/report/pictures.hpp"
#include "tools/report/sections.hpp"

namespace probebox::report {
namespace {

constexpr const char* kStyle = R"(
@page { size: A4; margin: 14mm; }
body { font: 10.5pt/1.4 sans-serif; color: #1a1a1a; background: #fff; max-width: 190mm; margin: 1em auto; padding: 0 1em; }
h1 { font-size: 15pt; margin: 0; } h2 { font-size: 11.5pt; margin: 1.2em 0 .3em; }
article + article { border-top: 2px solid #444; margin-top: 2em; padding-top: 1.5em; break-before: page; }
.verdict { font-size: 12.5pt; border-left: 6px solid #2a7a2a; background: #f1f7f1; padding: .6em .9em; margin: .7em 0; }
.verdict.warned { border-color: #b07a00; background: #fcf6e8; } .verdict.refused { border-color: #a11; background: #fbefef; }
table { border-collapse: collapse; margin: .2em 0; } td, th { padding: .15em .8em .15em 0; text-align: left; vertical-align: top; }
th { font-weight: 600; border-bottom: 1px solid #888; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
tr.sum td { border-top: 1px solid #888; font-weight: 600; } ul { margin: .2em 0; padding-left: 1.2em; }
.small { color: #444; font-size: 9pt; } .pictures { display: flex; flex-wrap: wrap; gap: 4mm; }
.pictures svg { width: 90mm; height: auto; border: 1px solid #ccc; break-inside: avoid; }
@media print { body { margin: 0; padding: 0; max-width: none; } h2 { break-after: avoid; } tr { break-inside: avoid; } }
)";

std::string picturesOf(const Subject& subject) {
  const auto plots = pictures(subject);
  if (plots.empty()) return {};
  std::string text = "<h2>Pictures</h2>\n<div class=\"pictures\">\n";
  for (const auto& plot : plots) text += plot.svg();
  return text + "</div>\n";
}

std::string article(const Subject& subject) {
  std::string text = "<article>\n" + heading(subject) + verdict(subject);
  if (const auto* result = subject.result()) {
    text += valuesTable(*result) + warningsList(*result) + budgetTable(*result) + picturesOf(subject) +
            factsTable(*result) + unobservableList(*result) + droppedList(*result) + alsoTable(*result);
  } else {
    text += picturesOf(subject);
  }
  return text + conditionsTable(subject) + "</article>\n";
}

}  // namespace

std::string page(std::span<const Subject> subjects, const std::string& version) {
  std::string title = "probebox report";
  if (subjects.size() == 1) title += ": " + subjects.front().name;
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width\"/>\n" +
      element("title", title) + "\n<style>" + kStyle + "</style>\n</head>\n<body>\n";
  for (const auto& subject : subjects) text += article(subject);
  return text + "<p class=\"small\">probebox " + escaped(version) +
         "; equations as numbered in docs/metrology.md; sd is one standard deviation (k = 1), U = 2 combined standard "
         "uncertainties (k = 2, about 95 %).</p>\n</body>\n</html>\n";
}

}  // namespace probebox::report
