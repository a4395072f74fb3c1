#include "firmware/metrology/delay/delay_per_axis.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 1> kKeys{"effective_diameter_mm"};

}  // namespace

Outcome<Result, Refusal> solveDelayPerAxis(const Dataset& dataset) {
  const auto diameter = configPositive(dataset, "effective_diameter_mm");
  if (!diameter) return diameter.error();
  const auto measured = TouchDelay::measure(dataset, {.delays = Delays::each_axis, .size_mm = diameter.value()});
  if (!measured) return measured.error();
  return measured->onSphere(kKeys);
}

}  // namespace probebox::metrology
