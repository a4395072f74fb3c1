#include "tools/report/values.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "tools/report/digits.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"

namespace probebox::report {
namespace {

using casefolder::Label;
using metrology::Estimate;
using metrology::Result;
using metrology::Shape;

constexpr std::size_t kShort = 3;        // numbers of a vector that stands in the table of short values
constexpr std::size_t kMostCells = 600;  // of one table: a compensation for a whole cycle has thousands
constexpr std::size_t kAcross = 4;       // numbers of a long vector side by side

std::string titled(const char* tag, const char* attributes, const std::string& text, double exact) {
  return "<" + std::string{tag} + attributes + " title=\"" + allDigits(exact) + "\">" + escaped(text) + "</" + tag +
         ">";
}

bool isShort(const Estimate& estimate) {
  return estimate.shape == Shape::scalar || (estimate.shape == Shape::vector && estimate.values.size() <= kShort);
}

std::string shortRow(const Subject& subject, const Estimate& estimate, std::size_t k) {
  constexpr const char* kNumber = " class=\"n\"";
  const Label unit = unitOf(estimate, k);
  const auto u = combinedOf(estimate, k);
  const auto sd = sdOf(estimate, k);
  std::string text = "<tr>" + element("td", valueName(subject, estimate, k)) +
                     titled("td", kNumber, valueDigits(unit, estimate.values[k], u), estimate.values[k]);
  text += u ? titled("td", kNumber, uncertaintyDigits(unit, *u), 2.0 * *u) : "<td class=\"n\">unknown</td>";
  text += sd ? titled("td", kNumber, casefolder::withUnit({"", "", unit.factor}, *sd), *sd)
             : "<td class=\"n\">unknown</td>";
  return text + element("td", unit.unit) + "</tr>\n";
}

// "-13.4 +- 1.1": value and U.
std::string cell(const Estimate& estimate, std::size_t k) {
  const Label unit = unitOf(estimate, k);
  const auto u = combinedOf(estimate, k);
  std::string text =
      "<td class=\"n\">" + titled("span", "", valueDigits(unit, estimate.values[k], u), estimate.values[k]);
  if (u && *u > 0) text += titled("small", "", " \u00b1 " + uncertaintyDigits(unit, *u), 2.0 * *u);
  return text + "</td>";
}

std::string withUnit(const std::string& name, const Label& unit) {
  return unit.unit.empty() ? name : name + " (" + unit.unit + ")";
}

std::string heading(const Estimate& estimate, const std::string& what) {
  std::string title = titleOf(estimate) + what;
  title.front() =
      static_cast<char>(title.front() >= 'a' && title.front() <= 'z' ? title.front() - 'a' + 'A' : title.front());
  return element("h2", title) + "\n";
}

std::string left(std::size_t shown, std::size_t all) {
  if (shown >= all) return {};
  return "<p class=\"small\">The first " + std::to_string(shown) + " of " + std::to_string(all) +
         " numbers; probebox solve --json has all of them.</p>\n";
}

// Down the columns, as one reads a list.
std::string listTable(const Estimate& estimate) {
  const std::size_t shown = std::min(estimate.values.size(), kMostCells);
  const std::size_t rows = (shown + kAcross - 1) / kAcross;
  std::string text = heading(estimate, withUnit("", unitOf(estimate, 0)) + ", value \u00b1 U (k = 2)") +
                     "<table class=\"values matrix\">\n";
  for (std::size_t row = 0; row < rows; ++row) {
    text += "<tr>";
    for (std::size_t at = row; at < shown; at += rows) {
      text += "<td class=\"key\">" + std::to_string(at + 1) + "</td>" + cell(estimate, at);
    }
    text += "</tr>\n";
  }
  return text + "</table>\n" + left(shown, estimate.values.size());
}

std::string shortTable(const Subject& subject, const Result& result) {
  std::string rows;
  std::string zero;
  for (const auto& estimate : result.estimates) {
    if (!isShort(estimate)) continue;
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      if (casefolder::zeroByDefinition(estimate, k)) {
        zero += (zero.empty() ? "" : ", ") + valueName(subject, estimate, k);
      } else {
        rows += shortRow(subject, estimate, k);
      }
    }
  }
  if (rows.empty()) return {};
  std::string text =
      "<h2>Values</h2>\n<table class=\"values\">\n<tr><th>value</th><th></th><th class=\"n\">U (k = 2)</th>"
      "<th class=\"n\">sd (k = 1)</th><th>unit</th></tr>\n" +
      rows + "</table>\n";
  if (!zero.empty())
    text += "<p class=\"small\">" + escaped("Zero by definition, so not listed: " + zero + ".") + "</p>\n";
  return text;
}

}  // namespace

std::string matrixTable(const Subject& subject, const Estimate& estimate) {
  std::string text = heading(estimate, ", value \u00b1 U (k = 2)") +
                     "<table class=\"values matrix\">\n<thead><tr><th>" +
                     std::string{isByAngle(estimate) ? "angle" : "at"} + "</th>";
  for (std::size_t column = 0; column < estimate.columns; ++column) {
    text += "<th class=\"n\">" + escaped(withUnit(columnName(subject, estimate, column), unitOf(estimate, column))) +
            "</th>";
  }
  text += "</tr></thead>\n<tbody>\n";
  const std::size_t rows = std::min(estimate.values.size(), kMostCells) / estimate.columns;
  for (std::size_t row = 0; row < rows; ++row) {
    text += "<tr>" + element("td", rowName(subject, estimate, row));
    for (std::size_t column = 0; column < estimate.columns; ++column)
      text += cell(estimate, row * estimate.columns + column);
    text += "</tr>\n";
  }
  return text + "</tbody></table>\n" + left(rows * estimate.columns, estimate.values.size());
}

std::string valueTables(const Subject& subject) {
  const Result& result = *subject.result();
  std::string text = shortTable(subject, result);
  for (const auto& estimate : result.estimates) {
    if (isShort(estimate) || estimate.values.empty()) continue;
    text += estimate.shape == Shape::matrix ? matrixTable(subject, estimate) : listTable(estimate);
  }
  if (!result.convention.empty()) text += "<p class=\"small\">" + escaped(result.convention) + "</p>\n";
  return text;
}

}  // namespace probebox::report
