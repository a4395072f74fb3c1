#include "firmware/metrology/delay/delay_known_sphere.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 1> kKeys{"effective_diameter_mm"};

}  // namespace

Outcome<Result, Refusal> solveDelayKnownSphere(const Dataset& dataset) {
  const auto diameter = requiredPositive(dataset, "effective_diameter_mm");
  if (!diameter) return diameter.error();
  const auto measured = TouchDelay::measure(dataset, {.size_mm = diameter.value()});
  if (!measured) return measured.error();
  Result result = measured->report(kKeys);
  result.estimates.push_back(measured->delay());
  if (const auto centre = measured->centre()) result.estimates.push_back(*centre);
  result.covariance = measured->covarianceOf(result.estimates);
  if (const auto gain = measured->gainMatrix()) result.estimates.push_back(*gain);
  return result;
}

}  // namespace probebox::metrology
