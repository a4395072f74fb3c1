#include <gmock/gmock.h>

#include "host-tests/support/no_alloc.hpp"
#include "turning.hpp"

namespace probebox::corrections {
namespace {

class TurningTable : public Turning {
 protected:
  explicit TurningTable(const CorrectionsConfig& config = turning(bitOf(SourceKind::rotary))) : Turning{config} {}

  void push(const std::vector<Event>& events) {
    for (const auto& event : events) {
      if (const auto* head = std::get_if<RotaryActivated>(&event)) machine.corrections.push(*head);
      if (const auto* row = std::get_if<ErrorsAtAngle>(&event)) machine.corrections.push(*row);
    }
  }
  Vector3d position() const { return {machine.position_mm[0], machine.position_mm[1], machine.position_mm[2]}; }
  // How far the point of the table that should be at `at` is from there.
  Vector3d errorOfC(double degrees, const Vector3d& at) const { return c.real(c.nominal(at, -degrees), degrees) - at; }
  void startTable() {
    start();
    homeC();
    push(c.result(11));
    run(2);
  }

  RealAxis c = RealAxis::random(RotaryAxis::c, {250, 40, -150}, Vector3d::UnitZ(), 3);
};

TEST_F(TurningTable, SaysNothingBeforeItsAngleIsReferenced) {
  start();
  push(c.result(11));
  run(1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().referenced);
  EXPECT_FALSE(machine.snapshot().rotary[2].known) << "the counts after power-up mean nothing";
  homeC();
  run(2);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().referenced);
  expectJointAt(errorOfC(0, position()));
  EXPECT_EQ(machine.snapshot().rotary[2].result_id, 11U);
  EXPECT_EQ(machine.snapshot().rotary[2].sd_errors[3], 1e-6);
}

TEST_F(TurningTable, IsFollowedAtEveryAngleAndPlace) {
  startTable();
  for (const double degrees : {30.0, 120.0, 330.0, 390.0, -60.0}) {
    turnC(degrees);
    run(2);
    ASSERT_TRUE(machine.snapshot().valid);
    expectJointAt(errorOfC(degrees, position()));
    for (std::size_t e = 0; e < 6; ++e) {
      const auto k = static_cast<std::size_t>(std::lround(degrees / 30) + 12) % 12;
      EXPECT_NEAR(machine.snapshot().rotary[2].errors[e], c.errors[k][static_cast<Eigen::Index>(e)], 1e-9);
    }
  }
  for (int i = 0; i < 100; ++i) machine.position_mm[0] -= 0.9, machine.position_mm[2] += 0.5, run(0.01);
  run(2);
  expectJointAt(errorOfC(-60, position()));
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(TurningTable, IsHeldWhileItsEncoderIsSilentAndThenSaysNothing) {
  startTable();
  const auto before_mm = joint_mm;
  machine.angle_deg[2].reset();
  run(1);
  EXPECT_EQ(health(kRotary), Health::held);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().degraded);
  run(2);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_EQ(machine.snapshot().correction_mm, before_mm);
  machine.angle_deg[2] = 0;
  run(1);
  EXPECT_TRUE(machine.snapshot().valid) << "the same counts: the reference still holds";
}

TEST_F(TurningTable, StandsWhenItsEncoderJumpsOrIsUnplugged) {
  startTable();
  turnC(30);
  run(1);
  const auto before_mm = joint_mm;
  *machine.angle_deg[2] += 40;  // within a tick
  run(1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_EQ(machine.snapshot().rotary[2].last_fault, ReferenceFault::impossible_speed);
  EXPECT_EQ(machine.snapshot().correction_mm, before_mm);
  homeC();
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  machine.corrections.push(SourceLost{Source::encoders, LossReason::disconnected, 0, machine.now});
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_EQ(machine.snapshot().rotary[2].last_fault, ReferenceFault::encoder_lost);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

// Encoders are mixed by axis: one that is unplugged takes no other's reference away, and one that lost counts is as
// good as unplugged.
TEST_F(TurningTable, StandsWhenItsOwnEncoderLosesCounts) {
  startTable();
  turnC(30);
  run(1);
  machine.corrections.push(SourceLost{Source::encoders, LossReason::overrun, 1, machine.now, axisBit(Axis::y)});
  run(0.5);
  EXPECT_TRUE(machine.snapshot().rotary[2].known);
  EXPECT_FALSE(machine.snapshot().referenced) << "Y";
  machine.home();
  run(0.5);
  EXPECT_TRUE(machine.snapshot().valid);
  machine.corrections.push(SourceLost{Source::encoders, LossReason::overrun, 1, machine.now, axisBit(RotaryAxis::c)});
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid);
  for (const auto& axis : machine.snapshot().axes) EXPECT_TRUE(axis.referenced);
  EXPECT_FALSE(machine.snapshot().rotary[2].known);
}

TEST_F(TurningTable, IsNotReferencedWhileItTurns) {
  start();
  push(c.result(11));
  for (int i = 0; i < 300; ++i) *machine.angle_deg[2] += 0.1, machine.tick();
  homeC();
  EXPECT_FALSE(machine.snapshot().valid);
  run(0.2);
  EXPECT_EQ(machine.snapshot().refused_homings, 1U);
  EXPECT_FALSE(machine.snapshot().rotary[2].known);
}

TEST_F(TurningTable, NeedsEveryLinearAxis) {
  startTable();
  ASSERT_TRUE(machine.snapshot().valid);
  machine.power_up += 20'000'000;
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().referenced);
}

TEST_F(TurningTable, SaysNothingWhereNobodyHasMeasured) {
  start();
  homeC();
  push(c.result(12, 0, 4));  // 0 to 90 degrees
  turnC(60);
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  turnC(91);
  run(1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().rotary[2].has_errors);
  turnC(90);
  run(2);
  EXPECT_TRUE(machine.snapshot().valid);
  expectJointAt(errorOfC(90, position()));
}

TEST_F(TurningTable, KeepsTheResultBeforeUntilTheLastRowOfTheNextOneIsThere) {
  startTable();
  const auto other = RealAxis::random(RotaryAxis::c, c.point, c.direction, 4);
  auto events = other.result(12);
  const auto last = events.back();
  events.pop_back();
  push(events);
  run(1);
  EXPECT_EQ(machine.snapshot().rotary[2].result_id, 11U);
  expectJointAt(errorOfC(0, position()));
  push({last});
  run(2);
  EXPECT_EQ(machine.snapshot().rotary[2].result_id, 12U);
  c = other;
  expectJointAt(errorOfC(0, position()));
  push({RotaryActivated{
      .result_id = 0, .axis = RotaryAxis::c, .point_mm = {}, .direction = {}, .sd = {}, .rows = 0, .at = {}}});
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

CorrectionsConfig tableOnTable() {
  auto config = turning(bitOf(SourceKind::rotary));
  config.rotary.count = 2;
  config.rotary.chain = {RotaryAxis::b, RotaryAxis::c};
  config.rotary.at_tip = true;
  config.rotary.tool_direction = {0, 0, -1};
  config.rotary.measured_length_mm = 100;
  return config;
}

class TableOnTable : public TurningTable {
 protected:
  TableOnTable() : TurningTable{tableOnTable()} {}
};

TEST_F(TableOnTable, CarriesTheErrorsOfTheInnerAxisWithTheOuterOne) {
  const auto b = RealAxis::random(RotaryAxis::b, {200, 0, -300}, Vector3d::UnitY(), 9);
  startTable();
  tellTool(4);
  runTelling(60, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "no result about B";
  push(b.result(21));
  turnC(120);
  runTelling(60, 3);
  ASSERT_TRUE(machine.snapshot().valid);
  const Vector3d tip = position() + Vector3d{0, 0, -20};  // tool 4 is 20 mm longer than the one that measured
  const Vector3d on_table = c.nominal(b.nominal(tip, -60), -120);
  expectJointAt(b.real(c.real(on_table, 120), 60) - tip);
  tellTool(0);
  runTelling(60, 1);
  EXPECT_FALSE(machine.snapshot().valid) << "where the tip is counts here";
}

TEST_F(TableOnTable, TakesNoMemoryFromResultToTick) {
  const auto b = RealAxis::random(RotaryAxis::b, {200, 0, -300}, Vector3d::UnitY(), 9).result(21);
  const auto on_b = c.result(11);
  const auto result = Head{}.result(7);
  start();
  const support::NoAlloc guard;
  machine.corrections.push(SourcesEnabled{.mask = 0b0110, .at = machine.now});
  machine.corrections.push(result);
  for (const auto* events : {&b, &on_b}) {
    machine.corrections.push(std::get<RotaryActivated>(events->front()));
    for (std::size_t k = 1; k < events->size(); ++k) machine.corrections.push(std::get<ErrorsAtAngle>((*events)[k]));
  }
  tellTool(4);
  homeC();
  runTelling(30, 2);
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_TRUE(machine.snapshot().valid);
}

TEST(ValidateActivation, NamesWhatTheMachineDoesNotHaveAndTablesThatCannotBeRead) {
  const auto reason = [](const CorrectionsConfig& config, const std::vector<Event>& result) {
    const auto error = validateActivation(config, result);
    return error ? error->what : std::string{};
  };
  auto config = turning(0);
  const auto c = RealAxis::random(RotaryAxis::c, {}, Vector3d::UnitZ(), 1);
  const auto a = RealAxis::random(RotaryAxis::a, {}, Vector3d::UnitX(), 1);
  EXPECT_EQ(reason(config, c.result(1)), "");
  EXPECT_THAT(reason(config, a.result(1)), testing::HasSubstr("not name"));
  EXPECT_THAT(reason(config, c.result(1, 11)), testing::HasSubstr("two angles"));
  auto twice = c.result(1);
  std::get<ErrorsAtAngle>(twice[3]).angle_rad = 0;
  EXPECT_THAT(reason(config, twice), testing::HasSubstr("twice"));
  config.rotary.between[2] = metrology::Between::fourier;
  EXPECT_EQ(reason(config, c.result(1)), "");
  EXPECT_THAT(reason(config, c.result(1, 0, 5)), testing::HasSubstr("equally spaced"));
  auto swivels = Head{}.result(2);
  EXPECT_EQ(reason(config, {swivels}), "");
  swivels.axis = RotaryAxis::a;
  EXPECT_THAT(reason(config, {swivels}), testing::HasSubstr("by A"));
  config.swivel.by_angle = true;
  EXPECT_THAT(reason(config, {Head{}.result(2)}), testing::HasSubstr("by_angle"));
  EXPECT_EQ(reason({}, a.result(1)), "") << "a machine without a table keeps the result and does nothing with it";
}

TEST(WhyRefused, NamesTheSectionThatASummedSourceNeeds) {
  for (const auto& [kind, section] :
       {std::pair{SourceKind::swivel, "[swivel]"}, {SourceKind::rotary, "[rotary_table]"}}) {
    auto config = turning(bitOf(kind));
    EXPECT_FALSE(validate(config));
    config.swivel = {};
    config.rotary = {};
    ASSERT_TRUE(validate(config));
    EXPECT_THAT(validate(config)->what, testing::HasSubstr(section));
  }
}

}  // namespace
}  // namespace probebox::corrections
