#include "firmware/metrology/delay/delay_joints.hpp"

#include <array>
#include <memory>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/kinematics/joint_chain.hpp"
#include "firmware/metrology/kinematics/parallel_kinematics.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kDelaysOfJoints{"common", "each-joint"};

template <class Machine>
Outcome<std::unique_ptr<Kinematics>, Refusal> readAs(const Dataset& dataset) {
  TRY(auto machine, Machine::read(dataset));
  return std::unique_ptr<Kinematics>{std::make_unique<Machine>(std::move(machine))};
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
  TRY(const auto kinematics, kinematicsOf(dataset));
  TRY(const auto diameter, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto delays, configWord(dataset, "delays", kDelaysOfJoints));
  TouchQuestion question{.size_mm = diameter};
  if (delays.value_or("common") == "each-joint") question.delays = Delays::each_joint;
  question.kinematics = kinematics.get();
  TRY(const auto measured, TouchDelay::measure(dataset, question));
  TRY(auto result, measured.onSphere());
  const auto* const idle = question.delays == Delays::each_joint ? "previous_tau_s" : "previous_tau_joint_s";
  if (dataset.config.contains(idle)) result.warnings.push_back(unusedKey(idle, dataset.method));
  return result;
}

namespace {

constexpr MethodColumn kJointColumns[]{
    column::kTouch, column::kTime, {"q1_rad", ColumnRole::angle}, column::given("q2_mm"), column::given("..")};
bool asksForEachJoint(const Dataset& dataset) {
  const auto found = dataset.config.find("delays");
  const auto* delays = found == dataset.config.end() ? nullptr : std::get_if<std::string>(&found->second);
  return delays != nullptr && *delays == "each-joint";
}

// The delay of each joint leans on the stated size, by the ways out alone.
std::optional<std::string> undeterminedOfJoints(const Dataset& dataset) {
  return asksForEachJoint(dataset) ? sizeBiasAtOneSpeed(dataset) : lostMotionAtOneSpeed(dataset);
}

// A delay of each joint is no delay of an axis.
std::optional<Subject> subjectOfJoints(const Dataset& dataset) {
  if (!asksForEachJoint(dataset)) return Subject{SubjectKind::delay, kAllAxes};
  return Subject{SubjectKind::delay_joints};
}

constexpr MethodTable kJointsTables[]{
    {"machine", kJointColumns, "joint positions at their stamp: _rad of a revolute joint, _mm of a prismatic one"},
    of_delay::kProbe,
    of_delay::kTouches,
    {"chain", kChainColumns, "a joint of a serial machine, from the base on"},
    {"legs", kLegColumns, "instead of chain: a leg of a parallel platform"}};
constexpr MethodKey kJointsKeys[]{
    {"tip_mm", kNeeded, "the tip with all joints at zero, or in the reference pose of the legs"},
    {"delays", "common", "common or each-joint"},
    of_delay::kDiameter,
    of_delay::kFeature,
    of_delay::kLostMotion,
    of_delay::previousTau("previous_tau_s", "0",
                          "delay already subtracted from the stamps, with delays common; tau_s includes it"),
    of_delay::previousTau(
        "previous_tau_joint_s", "zeros",
        "delays already subtracted from the stamps, with delays each-joint; tau_joint_s includes them")};
constexpr Quantity kJointsResults[]{quantity::kTau.as("delay of all joints, with delays common"), quantity::kTauJoint,
                                    quantity::kCentre.as("centre of the sphere in the frame of the machine's base")};
constexpr std::string_view kJointsUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps,
    "lengths and axes of the chain and the zeros of its joints: the stated ones are assumed exact",
    "delays that differ between the joints, where one is assumed for all"};

}  // namespace

const Method kDelayJoints{.name = "delay-joints",
                          .title = "System delay of a machine whose axes are joints",
                          .equations = "(A1)-(A7b), (A12), (A21)",
                          .source = source::kDelay,
                          .solver = solveDelayJoints,
                          .tables = kJointsTables,
                          .keys = kJointsKeys,
                          .known = of_delay::kDiameterKnown,
                          .results = kJointsResults,
                          .further = of_delay::kFurther,
                          .unobservable = kJointsUnobservable,
                          .undetermined = undeterminedOfJoints,
                          .subject = {.about = Subject{SubjectKind::delay, kAllAxes}, .of = subjectOfJoints}};

}  // namespace probebox::metrology
