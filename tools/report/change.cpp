#include "tools/report/change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

using casefolder::Label;
using metrology::Estimate;
using metrology::Result;

constexpr std::size_t kMostInTable = 12;  // components of a value that are compared one by one
constexpr double kLarge = 4.0;            // sd, beyond which `accept` asks

// One component of a value, now and before.
struct Change {
  const Estimate* now{};
  double then{};
  std::optional<double> then_u{};
  std::size_t k{};

  double by() const { return now->values[k] - then; }
  // sd of the difference of two independent results; nothing where one of them is unknown.
  std::optional<double> sd() const {
    const auto mine = combinedOf(*now, k);
    return mine && then_u ? std::optional{std::hypot(*mine, *then_u)} : std::nullopt;
  }
  std::optional<double> inSd() const {
    const auto known = sd();
    return known && *known > 0.0 ? std::optional{std::abs(by()) / *known} : std::nullopt;
  }
};

// Where the rows of a matrix are read, and how far two of them may differ to be the same.
struct PlaceOfRows {
  std::string_view key;
  double tolerance{};
};
constexpr std::array<PlaceOfRows, 4> kPlacesOfRows{{{quantity::kErrorAngles.key, 1e-6},
                                                    {quantity::kEachB.key, 1e-4},
                                                    {quantity::kQueryB.key, 1e-4},
                                                    {quantity::kQueryLength.key, 1}}};

// Values at angles can only be compared at the same angles.
bool comparable(const Result& a, const Result& b, const Estimate& estimate) {
  const auto* other = b.find(estimate.key);
  if (other == nullptr || other->values.size() != estimate.values.size()) return false;
  if (estimate.shape != metrology::Shape::matrix) return true;
  return std::ranges::all_of(kPlacesOfRows, [&](const PlaceOfRows& place) {
    const auto *here = a.find(place.key), *there = b.find(place.key);
    return here == nullptr || there == nullptr ||
           std::ranges::equal(here->values, there->values,
                              [&](double x, double y) { return std::abs(x - y) < place.tolerance; });
  });
}

// A value of another result; the centre of a leaning axis at the height of this one.
Estimate besideThis(const Result& now, const Result& then, Estimate value) {
  const auto* here = now.find(quantity::kMeanHeight.key);
  if (value.key == quantity::kCentre.key && here != nullptr) metrology::moveCentre(here->value(), then, now, value);
  return value;
}

std::vector<Change> changesBetween(const Result& now, const Result& then) {
  std::vector<Change> changes;
  for (const auto& estimate : now.estimates) {
    if (!comparable(now, then, estimate)) continue;
    const Estimate before = besideThis(now, then, *then.find(estimate.key));
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      if (!casefolder::zeroByDefinition(estimate, k))
        changes.push_back({&estimate, before.values[k], combinedOf(before, k), k});
    }
  }
  return changes;
}

std::string plain(double value) {
  return casefolder::withUnit({"", "", 1.0}, value);
}

std::string tail(const Label& unit) {
  return unit.unit.empty() ? "" : " " + unit.unit;
}

// Chooses all values, but of one with many components only the component that changed most.
std::vector<Change> worthTelling(const Subject& subject) {
  std::vector<Change> chosen;
  for (const auto& change : changesBetween(*subject.result(), subject.before.in_force->result)) {
    const bool same = !chosen.empty() && chosen.back().now == change.now;
    if (change.now->values.size() <= kMostInTable || !same) {
      chosen.push_back(change);
    } else if (change.inSd().value_or(0.0) > chosen.back().inSd().value_or(0.0)) {
      chosen.back() = change;
    }
  }
  return chosen;
}

std::string rowOf(const Subject& subject, const Change& change) {
  const Label unit = unitOf(*change.now, change.k);
  const auto sd = change.sd();
  const auto cell = [&](const std::string& text) { return "<td class=\"n\">" + escaped(text) + "</td>"; };
  std::string text = "<tr>" + element("td", valueName(subject, *change.now, change.k)) +
                     cell(valueDigits(unit, change.then, change.then_u)) +
                     cell(valueDigits(unit, change.now->values[change.k], combinedOf(*change.now, change.k))) +
                     cell(valueDigits(unit, change.by(), sd));
  text += cell(sd ? uncertaintyDigits(unit, *sd) : "unknown");
  text += cell(change.inSd() ? plain(*change.inSd()) : "unknown");
  return text + element("td", unit.unit) + "</tr>\n";
}

// The value whose trend is drawn: the first with few components.
const Estimate* followed(const Result& result) {
  const auto few = std::ranges::find_if(result.estimates, [](const Estimate& e) { return e.values.size() <= 3; });
  return few == result.estimates.end() ? nullptr : &*few;
}

// A value of an earlier result; place: how many results before this one, counted down to 0.
struct Seen {
  double place{};
  Estimate estimate;
};

// The same value of those of the last ten results that have it: other methods of the subject may not.
std::vector<Seen> earlierOf(const Subject& subject, const Estimate& now) {
  const auto& history = subject.before.history;
  std::vector<Seen> all;
  for (std::size_t at = history.size() > kTrend - 1 ? history.size() - (kTrend - 1) : 0; at < history.size(); ++at) {
    const auto* estimate = history[at].result.find(now.key);
    if (estimate == nullptr || estimate->values.size() != now.values.size()) continue;
    all.push_back({static_cast<double>(at) - static_cast<double>(history.size()),
                   besideThis(*subject.result(), history[at].result, *estimate)});
  }
  return all;
}

}  // namespace

std::vector<std::string> changeLines(const Subject& subject) {
  if (subject.result() == nullptr) return {};
  if (!subject.before.in_force) {
    if (subject.before.history.empty()) return {};
    return {"no other result about this is in force"};
  }
  const Earlier& force = *subject.before.in_force;
  const auto changes = changesBetween(*subject.result(), force.result);
  const auto in_sd = [](const Change& change) { return change.inSd().value_or(0.0); };
  const auto largest = std::ranges::max_element(changes, {}, in_sd);
  if (largest == changes.end()) return {"has no value in common with " + force.name + ", which is in force"};
  const Label unit = unitOf(*largest->now, largest->k);
  std::string text = "largest change against " + force.name +
                     ", in force: " + valueName(subject, *largest->now, largest->k) + " by " +
                     valueDigits(unit, largest->by(), largest->sd()) + tail(unit);
  if (const auto sd = largest->inSd())
    text += ", " + plain(*sd) + " sd" + (*sd > kLarge ? " of the difference: look why" : "");
  return {text};
}

std::string changeTable(const Subject& subject, const ChangeHeads& heads) {
  if (subject.result() == nullptr || !subject.before.in_force) return {};
  const Earlier& force = *subject.before.in_force;
  std::string rows;
  for (const auto& change : worthTelling(subject)) rows += rowOf(subject, change);
  if (rows.empty()) return {};
  return element("h2", heads.title) + "\n<table>\n<tr><th>value</th><th class=\"n\">" +
         escaped(heads.then + force.name) + "</th><th class=\"n\">" + escaped(heads.now) +
         "</th><th class=\"n\">change</th><th class=\"n\">U of change</th>" +
         "<th class=\"n\">in sd</th><th>unit</th></tr>\n" + rows + "</table>\n<p class=\"small\">" +
         escaped(force.name + ", " + force.utc + "; of a value with more than " + std::to_string(kMostInTable) +
                 " numbers the one that changed most.") +
         "</p>\n";
}

std::optional<Plot> trendPicture(const Subject& subject) {
  if (subject.result() == nullptr) return std::nullopt;
  const Estimate* now = followed(*subject.result());
  if (now == nullptr) return std::nullopt;
  const auto before = earlierOf(subject, *now);
  if (before.empty()) return std::nullopt;
  constexpr Look kLooks[]{Look::dots, Look::squares, Look::triangles};
  const Label unit = unitOf(*now, 0);
  Plot plot{"Trend of the last " + std::to_string(before.size() + 1) + " results, bars of U", "result (0: this one)",
            "minus this one" + (unit.unit.empty() ? "" : " (" + unit.unit + ")")};
  for (std::size_t k = 0; k < now->values.size(); ++k) {
    if (casefolder::zeroByDefinition(*now, k)) continue;
    std::vector<Point> points;
    std::vector<double> bars;
    const auto add = [&](const Estimate& estimate, double place) {
      points.push_back({place, (estimate.values[k] - now->values[k]) * unit.factor});
      bars.push_back(2.0 * combinedOf(estimate, k).value_or(0.0) * unit.factor);
    };
    for (const auto& [place, estimate] : before) add(estimate, place);
    add(*now, 0.0);
    plot.addWithBars(std::move(points), bars, kLooks[k % 3], valueName(subject, *now, k));
  }
  plot.addLevel(0.0);
  plot.countAcross();
  return plot;
}

}  // namespace probebox::report
