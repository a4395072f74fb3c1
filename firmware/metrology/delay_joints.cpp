#include "firmware/metrology/delay_joints.hpp"

#include <array>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/joint_chain.hpp"
#include "firmware/metrology/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 3> kKeys{"effective_diameter_mm", "tip_mm", "delays"};
constexpr std::array<std::string_view, 2> kDelays{"common", "each-joint"};

}  // namespace

Outcome<Result, Refusal> solveDelayJoints(const Dataset& dataset) {
  const auto chain = JointChain::read(dataset);
  if (!chain) return chain.error();
  const auto diameter = configPositive(dataset, "effective_diameter_mm");
  if (!diameter) return diameter.error();
  const auto delays = configWord(dataset, "delays", kDelays);
  if (!delays) return delays.error();
  TouchQuestion question{.size_mm = diameter.value()};
  if (delays->value_or("common") == "each-joint") question.delays = Delays::each_joint;
  question.chain = &chain.value();
  const auto measured = TouchDelay::measure(dataset, question);
  if (!measured) return measured.error();
  return measured->onSphere(kKeys);
}

}  // namespace probebox::metrology
