#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>

#include "firmware/metrology/dataset/verdict.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/wording.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/text/machine_verdict.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using messages::NamedValue;
using messages::Requirement;
using messages::ResultSummary;

// The limit of a value in the unit in which it is shown.
std::optional<double> limitIn(const std::string& unit, const Requirement* requirement) {
  if (requirement == nullptr) return std::nullopt;
  const auto stated = [](double limit) { return limit > 0 ? std::optional{limit} : std::nullopt; };
  if (unit == "um") return stated(requirement->limit_um);
  if (unit == "mm") return stated(requirement->limit_um * 1e-3);
  if (unit == "us") return stated(requirement->limit_us);
  if (unit == "urad") return stated(requirement->limit_urad);
  return unit == "deg" ? stated(degrees(requirement->limit_urad * 1e-6)) : std::nullopt;
}

DecisiveValue shownValue(const NamedValue& value, const std::string& axis, const Requirement* requirement) {
  const auto label = casefolder::quantityLabel(value.key, axis);
  DecisiveValue shown{.key = value.key,
                      .name = label.name,
                      .unit = label.unit,
                      .value = value.value * label.factor,
                      .text = label.name + " " + casefolder::withUncertainty(label, value.value, value.uncertainty()),
                      .limit = limitIn(label.unit, requirement)};
  if (const auto u = value.uncertainty()) shown.u = 2 * *u * std::abs(label.factor);
  if (!shown.limit) return shown;
  const bool deviation = casefolder::hasIdealZero(value.key);
  shown.proof = deviation ? metrology::proofOf(shown.value, shown.u, *shown.limit)
                : shown.u ? metrology::proofOf(*shown.u, 0.0, *shown.limit)
                          : metrology::Proof::not_proven;
  if (shown.u) shown.ratio = ((deviation ? std::abs(shown.value) : 0) + *shown.u) / *shown.limit;
  return shown;
}

// A check has been held against limits of its own by the box.
std::optional<DecisiveValue> ofCheck(const ResultSummary& result) {
  const auto valueOf = [&](std::string_view key) -> const NamedValue* {
    const auto found = std::ranges::find(result.values, key, &NamedValue::key);
    return found == result.values.end() ? nullptr : &*found;
  };
  const auto* verdict = valueOf(metrology::kVerdict);
  const auto* worst = valueOf(metrology::kWorstRatio);
  if (!isAbout(result.subject, SubjectKind::check) || verdict == nullptr) return std::nullopt;
  DecisiveValue shown{.key = std::string{metrology::kWorstRatio}, .name = "worst deviation with U, of its limit"};
  if (worst != nullptr) {
    shown.unit = "%";
    shown.value = 100 * worst->value;
    shown.ratio = worst->value;
    shown.text = shown.name + printed(" %.0f %%", shown.value);
    shown.limit = 100;
  } else {
    shown.text = shown.name + " not known";
  }
  shown.proof = metrology::proofNumbered(verdict->value);
  return shown;
}

bool isCertain(const NamedValue& value) {
  return value.has_sd && value.sd == 0 && (!value.has_u || value.u == 0);
}

// The worst answer comes first: with unequal U the larger share of a limit may be the better answer. Of equal answers
// deviations come before other values; then what is nearest to the limit or furthest beyond it, before which is what
// nobody knows U of; without a limit the largest.
bool comesBefore(const DecisiveValue& one, const DecisiveValue& other) {
  if (one.proof != other.proof) return one.proof > other.proof;
  const bool deviation = casefolder::hasIdealZero(one.key);
  if (deviation != casefolder::hasIdealZero(other.key)) return deviation;
  if (one.limit && other.limit) return other.ratio && (!one.ratio || *one.ratio > *other.ratio);
  if (!deviation) return one.u.has_value() && !other.u.has_value();
  return one.unit == other.unit &&
         std::abs(one.value) + one.u.value_or(0) > std::abs(other.value) + other.u.value_or(0);
}

// The values by which a result is judged, in the units in which they are shown; none of a check that has a verdict.
std::vector<DecisiveValue> judgedValues(const ResultSummary& result, const Requirement* requirement) {
  std::vector<DecisiveValue> all;
  if (ofCheck(result)) return all;
  const auto axis = casefolder::rotaryAxisOf(result.subject);
  const std::size_t about = result.about_count > 0 ? result.about_count : result.values.size();
  for (const auto& value : result.values | std::views::take(about))
    if (!isVerdict(value.key) && !isCertain(value)) all.push_back(shownValue(value, axis, requirement));
  return all;
}

}  // namespace

std::optional<DecisiveValue> decisiveValue(const ResultSummary& result, const Requirement* requirement) {
  if (auto check = ofCheck(result)) return check;
  std::optional<DecisiveValue> best;
  for (auto& shown : judgedValues(result, requirement))
    if (!best || comesBefore(shown, *best)) best = std::move(shown);
  return best;
}

std::vector<std::string> idleLimits(const ResultSummary& result, const Requirement& requirement) {
  struct Stated {
    std::string_view name;
    double limit{};
    Requirement alone;  // this limit, of any size
    bool bounds{};
  };
  std::array<Stated, 3> limits{Stated{"limit_um", requirement.limit_um, {.limit_um = 1}},
                               Stated{"limit_us", requirement.limit_us, {.limit_us = 1}},
                               Stated{"limit_urad", requirement.limit_urad, {.limit_urad = 1}}};
  std::string others;  // which would bound something
  for (auto& one : limits) {
    one.bounds =
        std::ranges::any_of(judgedValues(result, &one.alone), [](const auto& v) { return v.limit.has_value(); });
    if (one.bounds && !(one.limit > 0)) others += (others.empty() ? "" : " or ") + std::string{one.name};
  }
  std::vector<std::string> idle;
  for (const auto& one : limits)
    if (one.limit > 0 && !one.bounds)
      idle.push_back(std::string{one.name} + " of " + result.subject + " bounds no value of result " +
                     std::to_string(result.id) + ": " +
                     (others.empty() ? "remove it from machine.toml." : "state " + others + "."));
  return idle;
}

std::optional<ControlLimits> controlLimits(std::span<const TrendPoint> points) {
  constexpr double kOfMovingRange = 2.66;  // 3 / d2 of two values
  if (points.size() < kLeastForControl) return std::nullopt;
  double sum = 0, ranges = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    sum += points[k].value;
    if (k > 0) ranges += std::abs(points[k].value - points[k - 1].value);
  }
  const double mean = sum / static_cast<double>(points.size());
  const double reach = kOfMovingRange * ranges / static_cast<double>(points.size() - 1);
  return ControlLimits{mean, mean - reach, mean + reach};
}

std::string limitText(const DecisiveValue& decisive) {
  return decisive.limit ? printed("limit %g %s", *decisive.limit, decisive.unit.c_str()) : "no limit stated";
}

}  // namespace probebox::command
