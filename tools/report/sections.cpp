#include "tools/report/sections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/estimate.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "tools/case/budget_names.hpp"
#include "tools/case/readable.hpp"
#include "tools/report/conformity.hpp"
#include "tools/report/coverage.hpp"
#include "tools/report/digits.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"
#include "tools/report/reading_sd.hpp"
#include "tools/report/values.hpp"

namespace probebox::report {
namespace {

using casefolder::Label;
using casefolder::labelOf;
using casefolder::ofAReading;
using metrology::Estimate;
using metrology::Result;
using metrology::Shape;

constexpr std::size_t kMostRows = 72;   // numbers of what was found on the way
constexpr std::size_t kMostShares = 6;  // of the worst-determined combination

std::string numberCell(const std::string& text, double exact) {
  return "<td class=\"n\" title=\"" + allDigits(exact) + "\">" + escaped(text) + "</td>";
}

const std::vector<double>& combined(const Estimate& estimate) {
  return estimate.uncertainty.empty() ? estimate.sd : estimate.uncertainty;
}

std::string list(const char* title, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return {};
  std::string text = "<h2>" + std::string{title} + "</h2>\n<ul>\n";
  for (const auto& sentence : sentences) text += element("li", sentence) + "\n";
  return text + "</ul>\n";
}

std::string row(const std::string& name, const std::string& value) {
  return "<tr><td>" + escaped(name) + "</td><td>" + escaped(value) + "</td></tr>\n";
}

// A column of the budget: what of an estimate has one unit.
struct BudgetColumn {
  const Estimate& estimate;
  Label label;
  std::vector<std::size_t> at;
  std::size_t from{};  // where a budget line begins with the estimate

  double largest(const std::vector<double>& sd, std::size_t offset) const {
    double most = 0.0;
    for (const auto k : at) most = std::max(most, offset + k < sd.size() ? sd[offset + k] : 0.0);
    return most;
  }
  // whole: the combined one of the column, beside which a share may be nothing.
  std::string cell(double sd, double whole) const {
    return numberCell(casefolder::shareText({label.name, "", label.factor}, sd, whole), sd);
  }
  std::string title() const { return label.name + (label.unit.empty() ? "" : " (" + label.unit + ")"); }
};

std::vector<BudgetColumn> budgetColumns(const Result& result) {
  std::vector<BudgetColumn> columns;
  std::size_t from = 0;
  for (const auto& estimate : result.estimates) {
    for (const auto& part : metrology::partsOf(estimate)) {
      const Label unit = unitOf(estimate, part.at.front());
      const auto name = casefolder::keyInWords(labelOf(part.key).name);
      columns.push_back({estimate, {name, unit.unit, unit.factor}, part.at, from});
    }
    from += estimate.values.size();
  }
  return columns;
}

// Chi-square stands with the residuals, the decision at the head, the angles with their errors.
bool standsElsewhere(const std::string& key) {
  return key == metrology::kChiSquareDof || key == metrology::kNoiseDof || key == metrology::kVerdict ||
         key == metrology::quantity::kErrorAngles.key;
}

// " (um)", or nothing without a unit.
std::string unitsOf(const Estimate& estimate) {
  if (estimate.values.empty()) return {};
  const std::string unit = unitOf(estimate, 0).unit;
  return unit.empty() ? "" : " (" + unit + ")";
}

// A row of it would be lost in one paragraph.
bool isLongMatrix(const Estimate& estimate) {
  return estimate.shape == Shape::matrix && estimate.values.size() > 9;
}

// All numbers with their U, row by row.
std::string numbersOf(const Estimate& estimate) {
  std::string values;
  const std::size_t shown = std::min(estimate.values.size(), kMostRows);
  for (std::size_t k = 0; k < shown; ++k) {
    const Label unit = unitOf(estimate, k);
    const auto u = combinedOf(estimate, k);
    const bool new_row = estimate.shape == Shape::matrix && k % estimate.columns == 0;
    values += k == 0 ? "" : new_row ? "; " : ", ";
    // Without an uncertainty no more digits than a length of a metre has micrometres, and what residuals have.
    const bool of_residuals = estimate.key.find("rms") != std::string::npos;
    values +=
        u ? valueDigits(unit, estimate.values[k], u) : shortly(estimate.values[k] * unit.factor, of_residuals ? 3 : 7);
    if (u && *u > 0.0) values += " \u00b1 " + uncertaintyDigits(unit, *u);
  }
  if (shown < estimate.values.size()) values += " (the first " + std::to_string(shown) + " numbers)";
  return values;
}

// The model of a swivelling head.
bool isModel(const Estimate& estimate) {
  return estimate.key == "model" || estimate.key == "recommended_model";
}

std::string modelOf(const Estimate& estimate) {
  constexpr std::array kModels{"sine", "rigid", "free"};
  const double number = estimate.value();
  return number >= 0 && number < static_cast<double>(kModels.size()) ? kModels[static_cast<std::size_t>(number)]
                                                                     : shortly(number, 3);
}

// "EXC at 60 deg" of a component's key such as "six_errors[2][0]"; the key itself where the result has no such value.
std::string nameOfComponent(const Subject& subject, const std::string& component) {
  const auto bracket = component.find('[');
  const auto* estimate = subject.result()->find(component.substr(0, bracket));
  if (estimate == nullptr) return component;
  if (bracket == std::string::npos) return valueName(subject, *estimate, 0);
  const auto row = static_cast<std::size_t>(std::atoi(component.c_str() + bracket + 1));
  const auto second = component.find('[', bracket + 1);
  const std::size_t at =
      second == std::string::npos
          ? row
          : row * estimate->columns + static_cast<std::size_t>(std::atoi(component.c_str() + second + 1));
  return at < estimate->values.size() ? valueName(subject, *estimate, at) : component;
}

// The worst-determined combination by its largest shares.
std::string combinationOf(const Subject& subject, const metrology::WorstDetermined& weakest) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < weakest.components.size(); ++k) order.push_back(k);
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t k) { return std::abs(weakest.coefficients[k]); });
  const std::size_t shown = std::min(order.size(), kMostShares);
  std::string text;
  for (std::size_t at = 0; at < shown; ++at) {
    const double share = weakest.coefficients[order[at]];
    text += at == 0 ? "" : share < 0.0 ? " - " : " + ";
    text += shortly(at == 0 ? share : std::abs(share), 4) + " (" +
            nameOfComponent(subject, weakest.components[order[at]]) + ")";
  }
  return shown < order.size()
             ? text + ", the largest " + std::to_string(shown) + " shares of " + std::to_string(order.size())
             : text;
}

// The reading furthest from the fit, in sd of one reading.
std::string furthestOff(const Result& result, double sd) {
  const auto& values = result.residuals.values;
  const auto furthest = std::ranges::max_element(values, {}, [](double value) { return std::abs(value); });
  const auto place = static_cast<std::size_t>(furthest - values.begin());
  return result.residuals.names[place] + ", by " + casefolder::withUnit({"", "", 1.0}, std::abs(*furthest) / sd) +
         " sd";
}

// "80", or "12 to 80" of several values; as in a certificate.
std::string effectiveDofText(const Result& result) {
  double least = HUGE_VAL, most = 0;
  bool any = false;
  for (const auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      if (combinedOf(estimate, k).value_or(0) <= 0) continue;
      const double dof = effectiveDof(result, estimate, k);
      least = any ? std::min(least, dof) : dof;
      most = any ? std::max(most, dof) : dof;
      any = true;
    }
  }
  if (!any) return {};
  const auto low = dofText(least), high = dofText(most);
  return (low == high ? low : low + " to " + high) + ", with type B (JCGM 100:2008, G.4)";
}

// What part of u squared each cause has, for the least known number of the first value: bars, the largest first.
std::string budgetChart(const Result& result) {
  constexpr double kLeast = 0.001;  // smaller parts would be bars of nothing
  const auto columns = budgetColumns(result);
  if (columns.empty() || combined(columns.front().estimate).empty()) return {};
  const auto& column = columns.front();
  const auto& whole = combined(column.estimate);
  const auto at = *std::ranges::max_element(column.at, {}, [&](std::size_t k) { return whole[k]; });
  std::vector<std::pair<double, std::string>> parts;
  double sum = 0;
  for (const auto& line : result.budget) {
    const double sd = column.from + at < line.sd.size() ? line.sd[column.from + at] : 0;
    parts.emplace_back(sd * sd, casefolder::budgetName(line.name));
    sum += sd * sd;
  }
  if (!(sum > 0)) return {};
  std::ranges::stable_sort(parts, std::ranges::greater{}, [](const auto& part) { return part.first; });
  std::string rows;
  for (const auto& [square, name] : parts) {
    const double part = 100 * square / sum;
    if (part < 100 * kLeast) continue;
    rows += "<tr>" + element("td", name) + "<td class=\"share\"><span style=\"width:" + shortly(part, 3) +
            "%\"></span></td><td class=\"n\">" + shortly(part, 2) + " %</td></tr>\n";
  }
  return element("h2", "What U of " + column.label.name + " is made of (parts of u\u00b2)") +
         "\n<table class=\"shares\">\n" + rows + "</table>\n";
}

}  // namespace

std::string heading(const Subject& subject) {
  const metrology::Method* method = metrology::methodNamed(subject.method);
  const std::string title{method == nullptr ? std::string_view{subject.method} : method->title};
  return element("h1", title) + "\n<p class=\"small\">method " + escaped(subject.method) + ", case " +
         escaped(subject.name) + "</p>\n";
}

std::string standardsTable(const Subject& subject) {
  std::string rows;
  for (const auto& estimate : subject.result()->estimates) {
    const auto* known = metrology::quantityOf(estimate.key);
    if (known == nullptr || known->standard.empty()) continue;
    rows += "<tr>" + element("td", std::string{known->standard}) + element("td", titleOf(estimate)) +
            element("td", numbersOf(estimate) + " " + unitOf(estimate, 0).unit) + "</tr>\n";
  }
  if (rows.empty()) return {};
  return "<h2>In the terms of the standards</h2>\n<table>\n<tr><th>term</th><th>here</th><th>value \u00b1 U (k = "
         "2)</th></tr>\n" +
         rows + "</table>\n";
}

std::string budgetTable(const Result& result) {
  if (result.budget.empty()) return {};
  constexpr const char* kUnknown = "<td class=\"n\">unknown</td>";
  const auto columns = budgetColumns(result);
  std::string text =
      "<h2>Budget (standard uncertainties; of several numbers the largest)</h2>\n<table>\n"
      "<tr><th>from</th><th>type</th>";
  for (const auto& column : columns) text += "<th class=\"n\">" + escaped(column.title()) + "</th>";
  text += "</tr>\n";
  for (const auto& line : result.budget) {
    const bool adds_nothing = std::ranges::all_of(line.sd, [](double sd) { return sd == 0; });
    // What a case states is shown all the same; a head that did not swivel is not.
    if (line.type_b && adds_nothing && !line.name.starts_with("sd_")) continue;
    text += "<tr>" + element("td", casefolder::budgetName(line.name)) + element("td", line.type_b ? "B" : "A");
    for (const auto& column : columns) {
      const bool unknown = !line.type_b && column.estimate.sd.empty();
      text += unknown ? kUnknown
                      : column.cell(column.largest(line.sd, column.from), column.largest(combined(column.estimate), 0));
    }
    text += "</tr>\n";
  }
  text += "<tr class=\"sum\"><td>U (k = 2)</td><td></td>";
  for (const auto& column : columns) {
    const auto& whole = combined(column.estimate);
    text += whole.empty() ? kUnknown : column.cell(2.0 * column.largest(whole, 0), 0);
  }
  text += "</tr>\n</table>\n";
  const bool only_a = std::ranges::none_of(result.budget, [](const auto& line) { return line.type_b; });
  if (only_a) text += "<p class=\"small\">No type B input is stated (certificate of a known size, temperature).</p>\n";
  return text + budgetChart(result);
}

std::string residualsTable(const Result& result) {
  std::string text = "<h2>Residuals</h2>\n<table>\n";
  const auto& unit = result.residuals.unit;
  text += row("residual rms", ofAReading(result.rms, unit));
  const auto sd = readingSd(result);
  if (sd)
    text += row("sd of one reading", ofAReading(*sd, unit) + (result.chi2_reduced ? "" : ", from these residuals"));
  if (sd && !result.residuals.values.empty() && result.dof > 0) text += row("furthest off", furthestOff(result, *sd));
  text += row("degrees of freedom \u03bd of the fit", std::to_string(result.dof) + ", readings minus unknowns");
  if (const auto effective = effectiveDofText(result); !effective.empty())
    text += row("effective degrees of freedom \u03bd_eff of u", effective);
  if (result.chi2_reduced) text += row("against the noise", casefolder::chiSquareText(result));
  return text + "</table>\n";
}

std::string warningsList(const Result& result) {
  return list("Warnings", result.warnings);
}

std::string droppedList(const Result& result) {
  std::vector<std::string> sentences;
  for (const auto& dropped : result.dropped) sentences.push_back(dropped.name + ": " + dropped.reason);
  return list("Dropped readings", sentences);
}

std::string unobservableList(const Subject& subject) {
  const Result& result = *subject.result();
  auto sentences = result.unobservable;
  if (result.weakest) {
    sentences.push_back("determined worst: " + combinationOf(subject, *result.weakest) + ", each in its own sd: " +
                        shortly(result.weakest->sd, 4) + " times as uncertain as if they were independent");
  }
  return list("What these data cannot observe", sentences);
}

std::string factsTable(const Result& result) {
  const metrology::Method* method = metrology::methodNamed(result.method);
  std::string text = "<h2>Method</h2>\n<table>\n" + row("method", result.method);
  if (method != nullptr) {
    text += row("equations", std::string{method->equations}) + row("source", std::string{method->source});
  }
  text += row("condition", shortly(result.condition, 4) + " (of the scaled Jacobian; 1 is best, 1e6 is refused)");
  if (const auto figure = result.designFigure()) {
    text +=
        row("design figure", "sd of " + casefolder::designText(metrology::partsOf(result.estimates.front()).front().key,
                                                               *figure, result.design_per));
  }
  return text + "</table>\n";
}

std::string alsoTable(const Subject& subject) {
  const Result& result = *subject.result();
  const auto judged = judgedValues(subject);
  const auto isJudged = [&](const Estimate& each) {
    return std::ranges::find(judged, &each, &Judged::deviation) != judged.end();
  };
  std::string rows, tables;
  for (const auto& estimate : result.also) {
    if (standsElsewhere(estimate.key) || isJudged(estimate)) continue;
    if (isLongMatrix(estimate)) {
      tables += matrixTable(subject, estimate);
    } else {
      rows += row(titleOf(estimate) + unitsOf(estimate), isModel(estimate) ? modelOf(estimate) : numbersOf(estimate));
    }
  }
  if (!rows.empty()) rows = "<h2>Found on the way (\u00b1 U, k = 2)</h2>\n<table>\n" + rows + "</table>\n";
  return rows + tables;
}

std::string conditionRows(std::span<const metrology::Condition> conditions) {
  std::string text;
  for (const auto& [name, value] : conditions) {
    if (name == metrology::kCuttingKey) continue;  // a count that the box alone can compare
    if (name == "temperature_c") {
      text += row("temperature", value + " \u00b0C");
    } else {
      text += row(casefolder::keyInWords(name), value);
    }
  }
  return text;
}

std::string conditionsTable(const Subject& subject) {
  std::string text;
  if (const auto* result = subject.result()) {
    text = conditionRows(result->conditions);
  } else if (subject.dataset) {
    text = conditionRows(metrology::conditionsOf(*subject.dataset));
  }
  if (text.empty())
    return "<p class=\"small\">The case states no conditions (probe, machine, mounting, temperature_c, "
           "measured_utc).</p>\n";
  return "<h2>Conditions</h2>\n<table>\n" + text + "</table>\n";
}

}  // namespace probebox::report
