#include "firmware/metrology/subject_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"

namespace probebox::metrology {
namespace {

// What counts for subjects of a kind and its variants, in the order in which it is told.
struct ValuesOfSubject {
  SubjectKind kind;
  std::array<const Quantity*, 5> values{};
  const Method* method{};  // its name is the subject of a result whose case gives no number
};
constexpr ValuesOfSubject kAbout[]{
    {SubjectKind::centreline,
     {&quantity::kCentre, &quantity::kCTilt, &quantity::kZSlide, &quantity::kCentreX, &quantity::kCTiltX}},
    {SubjectKind::spindle_offset, {&quantity::kOffsetCMinusA}},
    {SubjectKind::stylus_offset, {&quantity::kStylusOffset, &quantity::kStylusOffsetX, &quantity::kStylusOffsetY}},
    {SubjectKind::tool, {&quantity::kToolOffset, &quantity::kToolOffsetX, &quantity::kToolOffsetZ}, &kToolSetter},
    {SubjectKind::setter,
     {&quantity::kSetter, &quantity::kLink, &quantity::kSetterX, &quantity::kSetterZ, &quantity::kLinkX}},
};

Compared comparedOf(const Estimate& estimate) {
  const auto* quantity = quantityOf(estimate.key);
  return quantity == nullptr ? Compared::promised : quantity->compared;
}

}  // namespace

std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject) {
  const auto* about = std::ranges::find_if(kAbout, [&](const ValuesOfSubject& each) {
    return isAboutKindOf(subject, each.kind) || (each.method != nullptr && subject == each.method->name);
  });
  if (about == std::end(kAbout)) return result.estimates;
  std::vector<Estimate> found;
  for (const auto* value : about->values) {
    if (const auto* estimate = value == nullptr ? nullptr : result.find(value->key)) found.push_back(*estimate);
  }
  return found.empty() ? result.estimates : found;
}

std::vector<Estimate> valuesCompared(const Result& result, std::string_view subject) {
  auto values = valuesAbout(result, subject);
  std::erase_if(values, [](const Estimate& each) { return comparedOf(each) == Compared::never; });
  std::ranges::copy_if(result.also, std::back_inserter(values),
                       [](const Estimate& each) { return comparedOf(each) == Compared::always; });
  return values;
}

Result withKey(Result result, std::string_view key, std::string_view as) {
  for (auto* list : {&result.estimates, &result.also}) {
    for (auto& estimate : *list) {
      if (estimate.key == key) estimate.key = as;
    }
  }
  const auto rename = [&](std::vector<std::string>& components) {
    for (auto& name : components) {
      if (name == key || name.starts_with(std::string{key} + "[")) name.replace(0, key.size(), as);
    }
  };
  if (result.covariance) rename(result.covariance->components);
  if (result.weakest) rename(result.weakest->components);
  return result;
}

std::string unitOfRms(const Result& result) {
  constexpr std::array<std::string_view, 4> kUnits{"mm", "um", "rad", "units of the sensors"};
  if (!result.residuals.unit.empty()) return result.residuals.unit;
  for (const auto unit : kUnits) {
    if (result.design_per.ends_with(", " + std::string{unit})) return std::string{unit};
  }
  return "mm";
}

namespace {

const Estimate* slopeOf(const Result& result) {
  for (const auto* slope : {&quantity::kCTilt, &quantity::kCTiltX, &quantity::kZSlide}) {
    if (const auto* found = result.find(slope->key)) return found;
  }
  return nullptr;
}

void widen(std::vector<double>& sd, const std::vector<double>& of_slope, double up_mm) {
  for (std::size_t i = 0; i < std::min(sd.size(), of_slope.size()); ++i) sd[i] = std::hypot(sd[i], of_slope[i] * up_mm);
}

}  // namespace

void moveCentre(double z_mm, const Result& of, const Result& beside, Estimate& centre) {
  const auto* height = of.find(quantity::kMeanHeight.key);
  const auto* slope = slopeOf(of) != nullptr ? slopeOf(of) : slopeOf(beside);
  if (height == nullptr || slope == nullptr) return;
  const double up_mm = z_mm - height->value();
  for (std::size_t i = 0; i < std::min(centre.values.size(), slope->values.size()); ++i)
    centre.values[i] += slope->values[i] * up_mm;
  widen(centre.sd, slope->sd, up_mm);
  widen(centre.uncertainty, slope->uncertainty.empty() ? slope->sd : slope->uncertainty, up_mm);
}

}  // namespace probebox::metrology
