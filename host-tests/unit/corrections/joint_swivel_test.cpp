#include "turning.hpp"

namespace probebox::corrections {
namespace {

class SwivellingHead : public Turning {
 protected:
  SwivellingHead() : Turning{turning(bitOf(SourceKind::swivel))} {}
  Head head;
};

TEST_F(SwivellingHead, SaysNothingBeforeResultAngleAndToolAreKnown) {
  run(1);
  EXPECT_EQ(health(kSwivel), Health::invalid);
  machine.corrections.push(head.result(7));
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid) << "no angle, no tool";
  EXPECT_FALSE(machine.snapshot().referenced) << "nobody knows the angle that it needs";
  runTelling(30, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "no tool: its length is not zero, it is unknown";
  EXPECT_TRUE(machine.snapshot().referenced) << "a head needs no linear axis";
  tellTool(9);
  runTelling(30, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "machine.toml does not know tool 9";
  EXPECT_EQ(joint_mm, Vector{});
  tellTool(4);
  runTelling(30, 2);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_EQ(machine.snapshot().swivel.result_id, 7U);
  expectJointAt(head.error(30, 120));
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(SwivellingHead, GoesWithTheAngleAndTheTool) {
  machine.corrections.push(head.result(7));
  tellTool(4);
  for (const double degrees : {-90.0, -20.0, 0.0, 45.0, 90.0}) {
    runTelling(degrees, 4);
    expectJointAt(head.error(degrees, 120));
  }
  tellTool(5);
  runTelling(90, 3);
  expectJointAt(head.error(90, 170));
  tellTool(5, 151.5);
  runTelling(90, 3);
  expectJointAt(head.error(90, 151.5));
  EXPECT_LE(largest_step_mm, kStep_mm);
  tellTool(0, 100);
  run(0.3);
  EXPECT_FALSE(machine.snapshot().valid) << "an empty spindle has no length";
}

TEST_F(SwivellingHead, IsHeldWhenNobodyTellsItsAngleAndThenSaysNothing) {
  machine.corrections.push(head.result(7));
  tellTool(4);
  runTelling(60, 3);
  const auto before_mm = joint_mm;
  run(1.5);  // an angle is in doubt after 1 s, and held for 2
  EXPECT_EQ(health(kSwivel), Health::held);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_TRUE(machine.snapshot().rotary[1].doubtful);
  run(2.5);
  EXPECT_EQ(health(kSwivel), Health::invalid);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_EQ(joint_mm, before_mm) << "frozen, not ramped to zero";
  EXPECT_EQ(machine.snapshot().correction_mm, before_mm);
  runTelling(10, 3);
  EXPECT_TRUE(machine.snapshot().valid);
  expectJointAt(head.error(10, 120));
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(SwivellingHead, SaysNothingAnyMoreWithoutItsResult) {
  machine.corrections.push(head.result(7));
  tellTool(4);
  runTelling(60, 2);
  ASSERT_TRUE(machine.snapshot().valid);
  machine.corrections.push(SwivelActivated{.result_id = 0, .axis = RotaryAxis::b, .terms = {}, .rows = 0, .at = {}});
  runTelling(60, 1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_EQ(machine.snapshot().swivel.result_id, 0U);
}

CorrectionsConfig swivellingByAngle() {
  auto config = turning(bitOf(SourceKind::swivel));
  config.swivel.by_angle = true;
  return config;
}

class HeadByAngle : public Turning {
 protected:
  HeadByAngle() : Turning{swivellingByAngle()} {}
};

ErrorsAtAngle left(std::uint64_t id, double degrees, double x_mm) {
  return {.of = ErrorsOf::swivel,
          .axis = RotaryAxis::b,
          .result_id = id,
          .angle_rad = degrees * kDegree,
          .errors = {x_mm, 0, 0},
          .at = {}};
}

TEST_F(HeadByAngle, AddsWhatIsLeftAtEachAngleOnceTheLastRowIsThere) {
  auto result = Head{}.result(8);
  result.rows = 3;
  machine.corrections.push(result);
  tellTool(4);
  machine.corrections.push(left(8, 0, 0));
  machine.corrections.push(left(8, 90, 0.006));
  machine.corrections.push(left(3, 45, 1));  // of another result
  runTelling(67.5, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "a row is missing";
  machine.corrections.push(left(8, 45, 0.02));
  runTelling(67.5, 3);
  EXPECT_TRUE(machine.snapshot().valid);
  expectJointAt(Head{}.error(67.5, 120) + Vector3d{0.013, 0, 0});
  runTelling(100, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "nobody has measured beyond 90 degrees";
}

}  // namespace
}  // namespace probebox::corrections
