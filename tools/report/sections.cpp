#include "tools/report/sections.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/estimate.hpp"
#include "firmware/metrology/methods.hpp"
#include "tools/case/readable.hpp"
#include "tools/report/html.hpp"

namespace probebox::report {
namespace {

using casefolder::Label;
using casefolder::labelOf;
using casefolder::withUnit;
using metrology::Estimate;
using metrology::Result;
using metrology::Shape;

constexpr std::size_t kMostRows = 60;  // of the table of values
constexpr std::size_t kLong = 12;      // values: more than anybody reads first
constexpr std::string_view kSixErrors = "six_errors";
constexpr std::array<std::string_view, 6> kErrorNames{"EX", "EY", "EZ", "EA", "EB", "EC"};

// The shortest digits that read back as the same double.
std::string allDigits(double value) {
  std::array<char, 40> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

std::string shortly(double value) {
  std::array<char, 40> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 4);
  return {buffer.data(), end.ptr};
}

std::string numberCell(const std::string& text, double exact) {
  return "<td class=\"n\" title=\"" + allDigits(exact) + "\">" + escaped(text) + "</td>";
}

std::string partName(const Estimate& estimate, std::size_t k) {
  if (estimate.key == kSixErrors) {
    return std::string{kErrorNames[k % kErrorNames.size()]} + " [" + std::to_string(k / kErrorNames.size()) + "]";
  }
  std::string name = labelOf(estimate.key).name;
  std::ranges::replace(name, '_', ' ');
  if (estimate.shape == Shape::vector) name += " [" + std::to_string(k) + "]";
  if (estimate.shape == Shape::matrix) {
    name += " [" + std::to_string(k / estimate.columns) + "][" + std::to_string(k % estimate.columns) + "]";
  }
  return name;
}

// Six errors of a rotary axis have two units.
Label partLabel(const Estimate& estimate, std::size_t k) {
  if (estimate.key != kSixErrors) return labelOf(estimate.key);
  return k % kErrorNames.size() < 3 ? Label{estimate.key, "um", 1e3} : Label{estimate.key, "urad", 1e6};
}

// Short ones first: they are what a reader looks for.
std::vector<const Estimate*> inReadingOrder(const Result& result) {
  std::vector<const Estimate*> order;
  for (const bool is_long : {false, true}) {
    for (const auto& estimate : result.estimates) {
      if ((estimate.values.size() > kLong) == is_long) order.push_back(&estimate);
    }
  }
  return order;
}

std::optional<double> at(const std::vector<double>& list, std::size_t k) {
  return k < list.size() ? std::optional{list[k]} : std::nullopt;
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

std::string valueRow(const Estimate& estimate, std::size_t k) {
  const Label label = partLabel(estimate, k);
  const auto sd = at(estimate.sd, k);
  const auto u = at(combined(estimate), k);
  std::string text = "<tr>" + element("td", partName(estimate, k)) +
                     numberCell(casefolder::valueText(label, estimate.values[k], sd), estimate.values[k]);
  text += sd ? numberCell(withUnit({label.name, "", label.factor}, *sd), *sd) : "<td class=\"n\">unknown</td>";
  text += u ? numberCell(withUnit({label.name, "", label.factor}, 2.0 * *u), 2.0 * *u) : "<td class=\"n\">unknown</td>";
  return text + element("td", label.unit) + "</tr>\n";
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
  std::string cell(double sd) const { return numberCell(withUnit({label.name, "", label.factor}, sd), sd); }
  std::string title() const { return label.name + (label.unit.empty() ? "" : ", " + label.unit); }
};

std::vector<BudgetColumn> budgetColumns(const Result& result) {
  std::vector<BudgetColumn> columns;
  std::size_t from = 0;
  for (const auto& estimate : result.estimates) {
    for (const auto& part : metrology::partsOf(estimate)) {
      columns.push_back({estimate, labelOf(part.key), part.at, from});
    }
    from += estimate.values.size();
  }
  return columns;
}

std::string oneValue(const Estimate& estimate, std::size_t k) {
  const Label label = partLabel(estimate, k);
  const auto u = at(combined(estimate), k);
  std::string text = partName(estimate, k) + " = " + casefolder::withSd(label, estimate.values[k], at(estimate.sd, k));
  return u ? text + ", U = " + withUnit(label, 2.0 * *u) + " (k = 2)" : text + ", uncertainty unknown";
}

std::string remedyOf(const std::string& reason) {
  return reason.empty() ? "" : "<br/>" + escaped(reason);
}

}  // namespace

std::string heading(const Subject& subject) {
  const metrology::Method* method = metrology::methodNamed(subject.method);
  const std::string title{method == nullptr ? std::string_view{subject.method} : method->title};
  return element("h1", title) + "\n<p class=\"small\">method " + escaped(subject.method) + ", case " +
         escaped(subject.name) + "</p>\n";
}

std::string verdict(const Subject& subject) {
  if (const auto* refusal = subject.refusal()) {
    return "<p class=\"verdict refused\"><b>Refused: " + escaped(refusal->name) + "</b>" + remedyOf(refusal->reason) +
           "</p>\n";
  }
  const Result& result = *subject.result();
  if (result.estimates.empty()) return {};
  const Estimate& first = *inReadingOrder(result).front();
  const bool warned = !result.warnings.empty() || combined(first).empty();
  std::string text = warned ? "<p class=\"verdict warned\">" : "<p class=\"verdict\">";
  for (std::size_t k = 0; k < std::min<std::size_t>(first.values.size(), 3); ++k) {
    text += (k > 0 ? "<br/>" : "") + std::string{"<b>"} + escaped(oneValue(first, k)) + "</b>";
  }
  if (first.values.size() > 3) text += "<br/>and " + std::to_string(first.values.size() - 3) + " more, below";
  if (!result.warnings.empty()) {
    text += "<br/>with " + std::to_string(result.warnings.size()) +
            (result.warnings.size() == 1 ? " warning: read it" : " warnings: read them");
  }
  if (!result.dropped.empty()) text += "<br/>" + std::to_string(result.dropped.size()) + " dropped, named below";
  return text + "</p>\n";
}

std::string valuesTable(const Result& result) {
  std::string text =
      "<h2>Values</h2>\n<table class=\"values\">\n<tr><th>value</th><th></th><th class=\"n\">sd (k = 1)</th>"
      "<th class=\"n\">U (k = 2)</th><th>unit</th></tr>\n";
  std::size_t rows = 0;
  std::size_t hidden = 0;
  for (const auto* estimate : inReadingOrder(result)) {
    for (std::size_t k = 0; k < estimate->values.size(); ++k) {
      if (++rows > kMostRows) {
        ++hidden;
      } else {
        text += valueRow(*estimate, k);
      }
    }
  }
  text += "</table>\n";
  if (hidden > 0)
    text += "<p class=\"small\">and " + std::to_string(hidden) + " more: probebox solve --json has them</p>\n";
  if (!result.convention.empty()) text += "<p class=\"small\">" + escaped(result.convention) + "</p>\n";
  return text;
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
    text += "<tr>" + element("td", line.name) + element("td", line.type_b ? "B" : "A");
    for (const auto& column : columns) {
      const bool unknown = !line.type_b && column.estimate.sd.empty();
      text += unknown ? kUnknown : column.cell(column.largest(line.sd, column.from));
    }
    text += "</tr>\n";
  }
  text += "<tr class=\"sum\"><td>U (k = 2)</td><td></td>";
  for (const auto& column : columns) {
    const auto& whole = combined(column.estimate);
    text += whole.empty() ? kUnknown : column.cell(2.0 * column.largest(whole, 0));
  }
  text += "</tr>\n</table>\n";
  const bool only_a = std::ranges::none_of(result.budget, [](const auto& line) { return line.type_b; });
  if (only_a) text += "<p class=\"small\">No type B input is stated (certificate of a known size, temperature).</p>\n";
  return text;
}

std::string warningsList(const Result& result) {
  return list("Warnings", result.warnings);
}

std::string droppedList(const Result& result) {
  std::vector<std::string> sentences;
  for (const auto& dropped : result.dropped) sentences.push_back(dropped.name + ": " + dropped.reason);
  return list("Dropped readings", sentences);
}

std::string unobservableList(const Result& result) {
  auto sentences = result.unobservable;
  if (result.weakest) {
    std::string combination;
    for (std::size_t k = 0; k < result.weakest->components.size(); ++k) {
      const double share = result.weakest->coefficients[k];
      combination += std::string{k == 0        ? ""
                                 : share < 0.0 ? " - "
                                               : " + "} +
                     shortly(k == 0 ? share : std::abs(share)) + " " + result.weakest->components[k];
    }
    sentences.push_back("determined worst: " + combination + ", each in its own sd: " + shortly(result.weakest->sd) +
                        " times as uncertain as if they were independent");
  }
  return list("What these data cannot observe", sentences);
}

std::string factsTable(const Result& result) {
  const metrology::Method* method = metrology::methodNamed(result.method);
  std::string text = "<h2>Method</h2>\n<table>\n" + row("method", result.method);
  if (method != nullptr) {
    text += row("equations", std::string{method->equations}) + row("patent", std::string{method->source});
  }
  text += row("residual rms", shortly(result.rms) + (result.residuals.unit.empty() ? "" : " " + result.residuals.unit));
  text += row("degrees of freedom", std::to_string(result.dof));
  if (result.chi2_reduced)
    text += row("reduced chi-square", shortly(*result.chi2_reduced) + " (1 where the stated sigma holds)");
  text += row("condition", shortly(result.condition) + " (of the scaled Jacobian; 1 is best, 1e6 is refused)");
  if (const auto figure = result.designFigure()) {
    text +=
        row("design figure", "sd of " + casefolder::designText(metrology::partsOf(result.estimates.front()).front().key,
                                                               *figure, result.design_per));
  }
  return text + "</table>\n";
}

std::string alsoTable(const Result& result) {
  if (result.also.empty()) return {};
  std::string text = "<h2>Found on the way</h2>\n<table>\n";
  for (const auto& estimate : result.also) {
    std::string values;
    for (std::size_t k = 0; k < std::min(estimate.values.size(), kMostRows); ++k) {
      const bool new_row = estimate.shape == Shape::matrix && k % estimate.columns == 0;
      values += k == 0 ? "" : new_row ? "; " : ", ";
      values += casefolder::withSd(labelOf(estimate.key), estimate.values[k], at(estimate.sd, k));
    }
    std::string name = labelOf(estimate.key).name;
    std::ranges::replace(name, '_', ' ');
    text += row(name, values);
  }
  return text + "</table>\n";
}

std::string conditionsTable(const Subject& subject) {
  std::string text;
  if (const auto* result = subject.result()) {
    for (const auto& condition : result->conditions) text += row(condition.name, condition.value);
  } else if (subject.dataset) {
    for (const auto& condition : metrology::conditionsOf(*subject.dataset))
      text += row(condition.name, condition.value);
  }
  if (text.empty())
    return "<p class=\"small\">The case states no conditions (probe, machine, mounting, temperature_c, "
           "measured_utc).</p>\n";
  return "<h2>Conditions</h2>\n<table>\n" + text + "</table>\n";
}

}  // namespace probebox::report
