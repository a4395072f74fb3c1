#include "firmware/metrology/delay/delay_joints.hpp"

#include <array>
#include <memory>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/kinematics/joint_chain.hpp"
#include "firmware/metrology/kinematics/parallel_kinematics.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 3> kKeys{"effective_diameter_mm", "tip_mm", "delays"};
constexpr std::array<std::string_view, 2> kDelays{"common", "each-joint"};

template <class Machine>
Outcome<std::unique_ptr<Kinematics>, Refusal> readAs(const Dataset& dataset) {
  auto machine = Machine::read(dataset);
  if (!machine) return machine.error();
  return std::unique_ptr<Kinematics>{std::make_unique<Machine>(std::move(machine.value()))};
}

Outcome<std::unique_ptr<Kinematics>, Refusal> kinematicsOf(const Dataset& dataset) {
  if (!dataset.table("legs")) return readAs<JointChain>(dataset);
  if (dataset.table("chain")) {
    return Refusal{"bad-config", "the case has the tables 'chain' and 'legs': keep the one that describes the machine"};
  }
  return readAs<ParallelKinematics>(dataset);
}

}  // namespace

Outcome<Result, Refusal> solveDelayJoints(const Dataset& dataset) {
  const auto kinematics = kinematicsOf(dataset);
  if (!kinematics) return kinematics.error();
  const auto diameter = configPositive(dataset, "effective_diameter_mm");
  if (!diameter) return diameter.error();
  const auto delays = configWord(dataset, "delays", kDelays);
  if (!delays) return delays.error();
  TouchQuestion question{.size_mm = diameter.value()};
  if (delays->value_or("common") == "each-joint") question.delays = Delays::each_joint;
  question.kinematics = kinematics.value().get();
  const auto measured = TouchDelay::measure(dataset, question);
  if (!measured) return measured.error();
  return measured->onSphere(kKeys);
}

}  // namespace probebox::metrology
