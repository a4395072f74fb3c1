#include <gmock/gmock.h>
#include <span>

#include "session.hpp"

// The loop programs of lathes by Fanuc and Siemens, run as texts against the emulated lathe of X and Z.
namespace probebox::scenario {
namespace {

constexpr double kSafeZOfLathe_mm = 280;

class LoopOfLathe : public testing::TestWithParam<std::string> {
 protected:
  static constexpr Asked kDelay{.method = 1}, kPlates{.method = 3}, kJogs{.method = 9}, kSweep{.method = 10, .axis = 1},
      kTurningAxis{.method = 33}, kTurningTool{.method = 20, .tool = 4}, kCheck{.method = 14};
  static FanucProgram& fanucOf(OfAText& text) { return dynamic_cast<FanucProgram&>(*text.program); }
};

TEST_P(LoopOfLathe, MakesTheMovesOfTheKitsOwnLoopAndFindsTheTruth) {
  OfTheKit kit{0, 0, latheFacts()};
  OfAText text{GetParam(), 0, 0, latheFacts()};
  kit.standByThePlate();
  text.standByThePlate();
  for (const auto& run : {kDelay, kPlates, kJogs, kSweep, kTurningAxis, kTurningTool, kCheck}) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    EXPECT_EQ(text.control.registers().value(address::calibration_method), run.method);
    EXPECT_GT(withoutIdleChanges(kit.control.commanded()).size(), from) << "method " << run.method;
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from);
    ASSERT_FALSE(HasFatalFailure()) << "method " << run.method;
  }
  EXPECT_EQ(text.mounted, (std::vector{2, 1}));
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(text.control.orientations, 0) << "it would turn the part";
  EXPECT_EQ(text.control.plc().refusedWrites(), 0U);
  auto& box = text.control.registers();
  EXPECT_NEAR(box.value(address::delay_f32), 1e3 * text.control.scenario().truth().tau_s[0],
              4 * box.value(address::delay_sd_f32));
  const auto world = worldFor(latheFacts());
  const auto& axis = world.part_spindle;
  // At the height of the machine, with warm screws.
  const double at_mm =
      axis.point_mm[0] + axis.direction[0] / axis.direction[2] * (text.control.position('Z') - axis.point_mm[2]);
  EXPECT_NEAR(box.value(address::centreline_here), at_mm, 0.03);
}

// Arcs have X in diameters and their middle in radius.
TEST_P(LoopOfLathe, MovesALatheThatHasAYToo) {
  constexpr Asked kScan{.method = 26}, kDelayPerAxis{.method = 4}, kBallOnC{.method = 7};
  OfTheKit kit{0};
  OfAText text{GetParam(), 0, 0, usualFacts(), "XZYC"};
  for (const auto& run : {kScan, kDelayPerAxis, kBallOnC}) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from);
    ASSERT_FALSE(HasFatalFailure()) << "method " << run.method;
  }
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(text.control.orientations, 0);
}

TEST_P(LoopOfLathe, GoesItsWholeWayAboveEverythingFirst) {
  OfAText text{GetParam(), 2, 0, latheFacts()};
  ASSERT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
  EXPECT_EQ(text.control.contacts(), 0U);
  EXPECT_GE(text.control.lowest_mm, kSafeZOfLathe_mm - 1e-6);
}

TEST_P(LoopOfLathe, PressesByTheOvertravelFromTheContactWhereThePlaceIsOff) {
  OfAText text{GetParam(), 0, 0, latheFacts()};
  text.program->set("_pb_sphere_x", 120 - 0.4);
  auto& control = text.control;
  double deepest_mm = 0;
  control.at_wait = [&] {
    const auto pressed = control.scenario().machine().stylusDisplacementAt(control.scenario().now());
    deepest_mm = std::max(deepest_mm, std::abs(pressed[0]));
  };
  EXPECT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
  EXPECT_NEAR(deepest_mm, 0.5, 0.03);
}

TEST_P(LoopOfLathe, StopsWhereTheProbeTouchesOnTheWay) {
  OfAText text{GetParam(), 0, 0, latheFacts()};
  text.program->set("_pb_sphere_x", 120 - 14);
  EXPECT_THROW(text.program->call({1}), Alarm) << text.why();
  ASSERT_FALSE(text.control.commanded().empty());
  EXPECT_TRUE(text.control.commanded().back().guarded);
  EXPECT_EQ(text.control.contacts(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Of, LoopOfLathe, testing::Values("fanuc", "siemens"),
                         [](const auto& given) { return given.param; });

class FanucLathe : public LoopOfLathe {};

TEST_F(FanucLathe, GivesTheStateOfTheControlBack) {
  OfAText text{"fanuc", 2, 0, latheFacts()};
  auto& program = fanucOf(text);
  const auto modal = program.modal;
  const auto offsets = program.offsets;
  EXPECT_EQ(text.run(kDelay), kDone) << text.alarm;
  for (const int group : {4005, 4014, 4015, 4016}) EXPECT_EQ(program.modal.at(group), modal.at(group)) << group;
  EXPECT_EQ(program.offsets, offsets) << "X of G59 in the words in which it was";
  EXPECT_EQ(program.tool_offset, 0);
}

TEST_F(FanucLathe, RefusesWhatWouldBendTheWay) {
  for (const auto& [group, code] :
       {std::pair{4004, 68.0}, {4011, 51.0}, {4017, 68.1}, {4021, 12.1}, {4022, 51.1}, {4006, 20.0}, {4007, 41.0}}) {
    OfAText text{"fanuc", 0, 0, latheFacts()};
    fanucOf(text).modal[group] = code;
    EXPECT_THROW(text.program->call({1}), Alarm) << group;
    EXPECT_TRUE(text.control.commanded().empty()) << group;
  }
}

// To cancel one may move the axes.
TEST_F(FanucLathe, RefusesAnOffsetOfTheToolThatIsActive) {
  OfAText text{"fanuc", 0, 0, latheFacts()};
  fanucOf(text).tool_offset = 7;
  EXPECT_THROW(text.program->call({1}), Alarm);
  EXPECT_THAT(text.program->last, testing::HasSubstr("OFFSET 00"));
  EXPECT_TRUE(text.control.commanded().empty());
}

TEST_F(FanucLathe, TakesTheStationThatThePmcKeepsWhereTheTurretWasTurnedByHand) {
  for (const bool builders : {false, true}) {
    OfAText text{"fanuc", 2, 0, latheFacts()};
    text.control.takeTool(4);
    fanucOf(text).commanded_tool = 1;
    if (builders) text.program->set("_pb_spindle_at", FanucProgram::kToolOfTheBuilder);
    EXPECT_EQ(text.run(kDelay), kDone) << text.alarm;
    const auto& all = text.control.commanded();
    EXPECT_EQ(std::ranges::count(all, Commanded::Is::tool, &Commanded::is), 2) << "one of the test, one of the program";
    EXPECT_EQ(text.control.tool(), 1U);
  }
}

class SiemensLathe : public LoopOfLathe {};

TEST_F(SiemensLathe, GivesDiametersBack) {
  OfAText text{"siemens", 2, 0, latheFacts()};
  EXPECT_EQ(text.run(kDelay), kDone) << text.alarm;
  EXPECT_EQ(dynamic_cast<SiemensProgram&>(*text.program).modes.at('R'), 1);
}

}  // namespace
}  // namespace probebox::scenario
