#include "firmware/app/results/result_values.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"

namespace probebox::app {
namespace {

namespace quantity = metrology::quantity;

using metrology::Estimate;

messages::NamedValue named(std::string key, const Estimate& estimate, std::size_t i) {
  const bool has_sd = i < estimate.sd.size(), has_u = i < estimate.uncertainty.size();
  return {.key = std::move(key),
          .value = estimate.values[i],
          .sd = has_sd ? estimate.sd[i] : 0.0,
          .has_sd = has_sd,
          .u = has_u ? estimate.uncertainty[i] : 0.0,
          .has_u = has_u};
}

// One value a name: the parts of a vector get their index behind the key's stem.
void appendValues(const Estimate& estimate, std::vector<messages::NamedValue>& values) {
  for (std::size_t i = 0; i < estimate.values.size(); ++i) {
    const std::string index = estimate.values.size() == 1 ? "" : "[" + std::to_string(i) + "]";
    values.push_back(named(estimate.key + index, estimate, i));
  }
}

// Six deviations an angle: deviation_XC_at_60_deg_mm. EXC of ISO 230-7 is the error motion alone.
void appendSixErrors(const Estimate& six, const Estimate& angles_rad, const std::string& subject,
                     std::vector<messages::NamedValue>& values) {
  constexpr std::size_t kErrors = quantity::kSixErrors.columns.size();
  const auto axis = parseSubject(subject, SubjectKind::rotary);  // nothing where a case names none
  const std::string letter = axis ? std::string{"ABC"[axis->axis()]} : "";
  for (std::size_t i = 0; i < six.values.size(); ++i)
    values.push_back(named(metrology::deviationKey(letter, i % kErrors, angles_rad.values[i / kErrors]), six, i));
}

std::vector<double> combined(const std::vector<double>& one, const std::vector<double>& other, std::size_t count) {
  std::vector<double> sd;
  for (std::size_t i = 0; i < count && one.size() >= count && other.size() >= count; ++i)
    sd.push_back(std::hypot(one[i], other[i]));
  return sd;
}

void addToCovariance(metrology::Result& result, const Estimate& offset) {
  if (!result.covariance) return;
  if (offset.sd.size() < 2) return result.covariance.reset();
  auto& [components, values] = *result.covariance;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto at = std::ranges::find(components, std::string{quantity::kCentre.key} + "[" + std::to_string(i) + "]");
    if (at == components.end()) continue;
    const auto row = static_cast<std::size_t>(at - components.begin());
    values[row * components.size() + row] += offset.sd[i] * offset.sd[i];
  }
}

// One more line of the budget: nothing but centre_mm has the offset in it.
void addToBudget(metrology::Result& result, const Estimate& offset, const std::string& name) {
  const auto of_offset = uncertaintiesOf(offset);
  if (result.budget.empty() || of_offset.size() < 2) return;
  metrology::Contribution line{.name = name, .type_b = true, .sd = {}};
  for (const auto& estimate : result.estimates) {
    for (std::size_t i = 0; i < estimate.values.size(); ++i)
      line.sd.push_back(estimate.key == quantity::kCentre.key && i < 2 ? of_offset[i] : 0.0);
  }
  result.budget.push_back(std::move(line));
}

}  // namespace

const Estimate* servedGain(const metrology::Result& result) {
  const auto* gain = result.find(quantity::kGainMatrix.key);
  const bool known = gain != nullptr && !gain->sd.empty() && result.find(metrology::kGainTakenAt) != nullptr;
  return known ? gain : nullptr;
}

std::span<const double> uncertaintiesOf(const Estimate& estimate) {
  const bool combined = estimate.uncertainty.size() == estimate.values.size();
  return combined ? estimate.uncertainty : estimate.sd;
}

Outcome<Values> valuesOf(const metrology::Result& result, std::string_view key, std::size_t count) {
  const metrology::Estimate* found = result.find(key);
  const std::string whose = "The result of " + result.method;
  if (found == nullptr) return Error{whose + " has no value for " + std::string{key} + "."};
  if (count != 0 && found->values.size() != count) {
    return Error{whose + " has " + std::to_string(found->values.size()) + " values of " + std::string{key} + ", not " +
                 std::to_string(count) + "."};
  }
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const auto sd = uncertaintiesOf(*found);
  if (!std::ranges::all_of(found->values, is_finite) || !std::ranges::all_of(sd, is_finite))
    return Error{whose + " has a value of " + std::string{key} + " that is not a number: calibrate again."};
  return Values{found->values, sd};
}

void appendAll(const metrology::Result& result, const std::string& subject, std::vector<messages::NamedValue>& values) {
  const auto angles = std::ranges::find(result.also, quantity::kErrorAngles.key, &Estimate::key);
  for (const auto& estimate : result.estimates) {
    const bool by_angle = estimate.key == quantity::kSixErrors.key && angles != result.also.end() &&
                          estimate.values.size() == 6 * angles->values.size();
    if (by_angle)
      appendSixErrors(estimate, *angles, subject, values);
    else
      appendValues(estimate, values);
  }
}

std::optional<Estimate> stylusOffsetOf(const metrology::Result& result) {
  if (const auto* offset = result.find(quantity::kStylusOffset.key); offset != nullptr && offset->values.size() >= 2)
    return *offset;
  const auto* x = result.find(quantity::kStylusOffsetX.key);
  const auto* y = result.find(quantity::kStylusOffsetY.key);
  if (x == nullptr || y == nullptr) return std::nullopt;
  const auto both = [&](std::vector<double> Estimate::*part) {
    const auto &of_x = x->*part, &of_y = y->*part;
    return of_x.empty() || of_y.empty() ? std::vector<double>{} : std::vector{of_x.front(), of_y.front()};
  };
  auto offset =
      Estimate::vector(std::string{quantity::kStylusOffset.key}, {x->value(), y->value()}, both(&Estimate::sd));
  offset.uncertainty = both(&Estimate::uncertainty);
  return offset;
}

std::uint32_t probeToolOf(const metrology::Result& result) {
  const auto stated = std::ranges::find(result.conditions, "probe_tool", &metrology::Condition::name);
  if (stated == result.conditions.end()) return 1;
  std::uint32_t tool = 0;
  const auto& text = stated->value;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), tool);
  return error == std::errc{} && end == text.data() + text.size() && tool > 0 ? tool : 1;
}

std::optional<metrology::Result> relativeToSpindle(metrology::Result from_tip, const Estimate& offset,
                                                   store::Id offset_id) {
  auto centre = std::ranges::find(from_tip.estimates, quantity::kCentre.key, &Estimate::key);
  if (centre == from_tip.estimates.end()) {
    centre = std::ranges::find(from_tip.also, quantity::kCentre.key, &Estimate::key);
    if (centre == from_tip.also.end()) return std::nullopt;
  }
  if (centre->values.size() != 2 || offset.values.size() < 2) return std::nullopt;
  const std::string name = "stylus offset of result " + std::to_string(offset_id);
  auto tip = *centre;
  tip.key = "tip_centre_mm";
  auto added = offset;
  added.key = quantity::kStylusOffsetInForce.key;
  for (std::size_t i = 0; i < 2; ++i) centre->values[i] += offset.values[i];
  const auto& of_offset = offset.uncertainty.size() >= 2 ? offset.uncertainty : offset.sd;
  centre->uncertainty = combined(tip.uncertainty, of_offset, 2);
  centre->sd = combined(tip.sd, offset.sd, 2);
  addToCovariance(from_tip, offset);
  addToBudget(from_tip, offset, name);
  from_tip.weakest.reset();
  from_tip.also.push_back(std::move(tip));  // `centre` may be gone from here on
  from_tip.also.push_back(std::move(added));
  std::erase_if(from_tip.warnings, [](const std::string& each) { return each.starts_with("the spindle stood still"); });
  from_tip.warnings.push_back("centre_mm has the " + name + " in it, read at A = 0");
  return from_tip;
}

}  // namespace probebox::app
