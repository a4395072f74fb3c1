#include "firmware/app/results/compared_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <span>
#include <string_view>
#include <utility>

#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/subject_values.hpp"

namespace probebox::app {
namespace {

namespace quantity = metrology::quantity;

constexpr std::size_t kMostValues = 60;  // what an answer of a link holds
constexpr std::size_t kMostNamed = 6;    // of them in a sentence

using metrology::Estimate;

std::string number(const char* format, double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// A delay common to all axes is one of each.
std::vector<Estimate> delayByAxis(const metrology::Result& result) {
  const auto* common = result.find(quantity::kTau.key);
  if (const auto* by_axis = result.find(quantity::kTauAxis.key)) return {*by_axis};
  if (common == nullptr) return result.estimates;
  const auto thrice = [](const std::vector<double>& value) {
    return value.empty() ? value : std::vector<double>(3, value.front());
  };
  auto by_axis = Estimate::vector(std::string{quantity::kTauAxis.key}, thrice(common->values), thrice(common->sd));
  by_axis.uncertainty = thrice(common->uncertainty);
  return {std::move(by_axis)};
}

// Of the axes that the subject names, each by its own key: a result about all of them has it too.
std::vector<Estimate> delayOfSome(const metrology::Result& result, const Subject& subject) {
  const auto by_axis = delayByAxis(result).front();
  std::vector<Estimate> some;
  for (std::size_t axis = 0; axis < kLinearAxes && by_axis.values.size() == kLinearAxes; ++axis) {
    if (!subject.has(axis)) continue;
    const bool has_sd = by_axis.sd.size() == kLinearAxes;
    some.push_back(Estimate::scalar(std::string{"tau_"} + "xyz"[axis] + "_s", by_axis.values[axis],
                                    has_sd ? std::optional{by_axis.sd[axis]} : std::nullopt));
    if (by_axis.uncertainty.size() == kLinearAxes) some.back().uncertainty = {by_axis.uncertainty[axis]};
  }
  return some;
}

std::vector<Estimate> quantitiesOf(const metrology::Result& result, const std::string& subject) {
  if (const auto delay = parseSubject(subject, SubjectKind::delay)) {
    auto quantities = delay->of == kAllAxes ? delayByAxis(result) : delayOfSome(result, *delay);
    if (const auto* gain = servedGain(result)) quantities.push_back(*gain);
    return quantities;
  }
  if (isAbout(subject, SubjectKind::stylus_offset)) {
    if (const auto offset = stylusOffsetOf(result)) return {*offset};
  }
  return metrology::valuesCompared(result, subject);
}

// With the type B part: two methods do not share what they take as known, so it does not cancel between them.
void takeCombined(std::vector<Estimate>& quantities) {
  for (auto& quantity : quantities) {
    if (quantity.uncertainty.size() == quantity.values.size()) quantity.sd = quantity.uncertainty;
  }
}

std::vector<double> part(const std::vector<double>& all, std::size_t from, std::size_t count) {
  if (from + count > all.size()) return {};
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(from);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

// A matrix with a row for each B of a swivelling head becomes a vector for each, under the name of its B: two results
// may have other B, and one without a B is of a level head.
void nameByB(const metrology::Result& result, std::vector<Estimate>& quantities) {
  const auto* several = result.find(quantity::kEachB.key);
  const auto b_deg = several != nullptr ? several->values : std::vector<double>{0};
  std::vector<Estimate> named;
  for (const auto& each : quantities) {
    const std::size_t columns = each.values.size() / b_deg.size();
    for (std::size_t row = 0; row < b_deg.size(); ++row) {
      auto& at = named.emplace_back(each);
      at.key += number("_at_B_%.6g_deg", b_deg[row]);
      at.values = part(each.values, row * columns, columns);
      at.sd = part(each.sd, row * columns, columns);
      at.uncertainty = part(each.uncertainty, row * columns, columns);
    }
  }
  quantities = std::move(named);
}

std::optional<double> sdOf(const messages::NamedValue& value) {
  return value.has_sd ? std::optional{value.sd} : std::nullopt;
}

std::vector<messages::NamedValue> namedValues(const metrology::Result& result, std::vector<Estimate> quantities,
                                              const std::string& subject) {
  metrology::Result alone;
  alone.estimates = std::move(quantities);
  alone.also = result.also;
  std::vector<messages::NamedValue> values;
  appendAll(alone, subject, values);
  return values;
}

// The largest differences, in their order.
void keepLargest(Comparison& comparison) {
  auto& values = comparison.values;
  if (values.size() <= kMostValues) return;
  auto sizes = values;
  std::ranges::nth_element(sizes, sizes.begin() + kMostValues - 1, std::greater{},
                           [](const ComparedValue& each) { return each.inSd().value_or(INFINITY); });
  const double least = sizes[kMostValues - 1].inSd().value_or(INFINITY);
  const std::size_t before = values.size();
  std::erase_if(values, [&](const ComparedValue& each) { return each.inSd().value_or(INFINITY) < least; });
  if (values.size() > kMostValues) values.resize(kMostValues);
  comparison.omitted = before - values.size();
}

}  // namespace

std::optional<double> ComparedValue::inSd() const {
  const double combined = std::hypot(sd.value_or(0), sd_before.value_or(0));
  return combined > 0 ? std::optional{std::abs(difference()) / combined} : std::nullopt;
}

bool ComparedValue::differs() const {
  const auto in_sd = inSd();
  return in_sd ? *in_sd > kMostSd : difference() != 0;
}

bool Comparison::differs() const {
  return !first() && (values.empty() || std::ranges::any_of(values, &ComparedValue::differs));
}

Comparison compare(const store::Record& next, const store::Record& in_force) {
  Comparison comparison{.with = in_force.id, .values = {}, .omitted = 0};
  const auto* result = next.result();
  const auto* other = in_force.result();
  if (result == nullptr || other == nullptr) return comparison;
  const auto& subject = next.binding.subject;
  auto quantities = quantitiesOf(*result, subject);
  auto others = quantitiesOf(*other, subject);
  if (result->method != other->method) {
    takeCombined(quantities);
    takeCombined(others);
  }
  const auto* z = result->find(quantity::kMeanHeight.key);
  const auto centre = std::ranges::find_if(others, [](const Estimate& each) {
    return each.key == quantity::kCentre.key || each.key == quantity::kCentreX.key;
  });
  if (z != nullptr && centre != others.end()) metrology::moveCentre(z->value(), *other, *result, *centre);
  if (result->find(quantity::kEachB.key) != nullptr || other->find(quantity::kEachB.key) != nullptr) {
    nameByB(*result, quantities);
    nameByB(*other, others);
  }
  // Tables of different lengths have no rows in common.
  std::erase_if(others, [&](const Estimate& each) {
    const auto same = std::ranges::find(quantities, each.key, &Estimate::key);
    return each.key != quantity::kSixErrors.key &&
           (same == quantities.end() || same->values.size() != each.values.size());
  });
  const auto before = namedValues(*other, std::move(others), subject);
  for (const auto& value : namedValues(*result, quantities, subject)) {
    const auto found = std::ranges::find(before, value.key, &messages::NamedValue::key);
    if (found == before.end()) continue;
    comparison.values.push_back({.key = value.key,
                                 .value = value.value,
                                 .sd = sdOf(value),
                                 .before = found->value,
                                 .sd_before = sdOf(*found),
                                 .u = value.uncertainty(),
                                 .u_before = found->uncertainty()});
  }
  keepLargest(comparison);
  return comparison;
}

std::optional<std::string> lessCertain(const Comparison& comparison) {
  constexpr double kGrown = 1.5;
  const ComparedValue* worst = nullptr;
  double growth = kGrown;
  for (const auto& each : comparison.values) {
    const double before = each.u_before.value_or(0);
    if (!(before > 0) || each.u.value_or(0) <= growth * before) continue;
    worst = &each;
    growth = *each.u / before;
  }
  if (worst == nullptr) return std::nullopt;
  return worst->key + " from " + number("%.3g", *worst->u_before) + " to " + number("%.3g", *worst->u);
}

std::string differencesIn(const Comparison& comparison) {
  if (comparison.values.empty()) return "they have no value in common";
  std::string text;
  std::size_t named = 0, more = 0;
  for (const auto& each : comparison.values) {
    if (!each.differs()) continue;
    if (named == kMostNamed) {
      ++more;
      continue;
    }
    ++named;
    const auto in_sd = each.inSd();
    text += (text.empty() ? "" : ", ") + each.key + " " + number("%.9g", each.value) + " instead of " +
            number("%.9g", each.before) + " (" + number("%+.3g", each.difference()) + ", " +
            (!in_sd         ? "without a standard deviation"
             : *in_sd > 999 ? "more than 999 sd"
                            : number("%.3g sd", *in_sd)) +
            ")";
  }
  return more == 0 ? text : text + " and " + std::to_string(more) + " more";
}

}  // namespace probebox::app
