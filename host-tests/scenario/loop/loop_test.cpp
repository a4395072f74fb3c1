#include <algorithm>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <tuple>

#include "protocol/units/angle.hpp"
#include "session.hpp"

// The loop programs of Fanuc and Siemens, run as texts against an emulated box and its machine.
namespace probebox::scenario {
namespace {

// Touches with and without a dwell, jogs, sweeps, a rest (whose screws still warm up), touches of the setter with a
// cutting tool, the head swivelled, C turned, holds.
constexpr std::array kRuns =
    std::to_array<Asked>({{4}, {6}, {9}, {10, 1}, {25, 1, 0, kRefused}, {20, 0, 4}, {17}, {8}, {22}});

class LoopProgram : public testing::TestWithParam<std::string> {
 protected:
  // Nothing was touched, the run is over, and the machine stands at the safe height.
  static void expectUntouched(OfAText& text) {
    EXPECT_EQ(text.control.contacts(), 0U);
    EXPECT_EQ(text.control.crashes(), 0U);
    EXPECT_GE(text.control.lowest_mm, kSafeZ_mm - 1e-6);
    EXPECT_EQ(text.control.registers().value(address::step_state), 6) << "aborted";
  }
};

TEST_P(LoopProgram, MakesTheMovesOfTheKitsOwnLoop) {
  OfTheKit kit{0};
  OfAText text{GetParam(), 0};
  for (const auto& run : kRuns) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    EXPECT_EQ(text.control.registers().value(address::calibration_method), run.method);
    if (run.came == kDone) {
      EXPECT_GT(withoutIdleChanges(kit.control.commanded()).size(), from) << "method " << run.method;
    }
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from);
    if (HasFatalFailure()) FAIL() << "method " << run.method;
  }
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(text.control.plc().refusedWrites(), 0U);
}
TEST_P(LoopProgram, GoesItsWholeWayAboveEverythingFirst) {
  OfAText text{GetParam(), 1};
  auto& control = text.control;
  std::size_t dry_end = 0;
  control.at_stop = [&] {
    EXPECT_EQ(control.contacts(), 0U);
    EXPECT_GE(control.lowest_mm, kSafeZ_mm - 1e-6);
    EXPECT_EQ(control.registers().value(address::step_number), 0);
    EXPECT_EQ(control.registers().value(address::step_state), 1);
    dry_end = control.commanded().size();
  };
  ASSERT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  ASSERT_NE(dry_end, 0U);
  EXPECT_LT(control.lowest_mm, kSafeZ_mm - 20) << "then it measures";
  constexpr double kOff_mm = 0.6;  // of the places, which each touch corrects by its contact
  const auto& all = control.commanded();
  const auto dry = std::span{all}.first(dry_end);
  for (std::size_t i = dry_end; i < all.size(); ++i) {
    if (all[i].is != Commanded::Is::move) continue;
    const bool was_there = std::ranges::any_of(dry, [&](const Commanded& one) {
      return one.is == Commanded::Is::move && std::abs(one.to[0] - all[i].to[0]) < kOff_mm &&
             std::abs(one.to[1] - all[i].to[1]) < kOff_mm;
    });
    EXPECT_TRUE(was_there) << "the dry run left out " << all[i].to[0] << " " << all[i].to[1];
  }
}

TEST_P(LoopProgram, EndsBehindADryRunThatIsAllThatWasAskedFor) {
  OfAText text{GetParam(), 2};
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  expectUntouched(text);
}

TEST_P(LoopProgram, RefusesAStepBeyondItsLimits) {
  for (const auto& [limit, most] : {std::pair{"_pb_most_feed", 200.0}, std::pair{"_pb_most_way", 0.3}}) {
    OfAText text{GetParam(), 0};
    text.program->set(limit, most);
    EXPECT_EQ(text.run({4}), kBeyond) << limit << text.why() << text.alarm;
    expectUntouched(text);
  }
}

TEST_P(LoopProgram, RefusesAKindThatItDoesNotKnow) {
  OfAText text{GetParam(), 0};
  text.control.plc().feign(gcode::loop::placeRead("probebox.step-kind")->word, 8);
  EXPECT_EQ(text.run({4}), kBeyond) << text.why() << text.alarm;
  expectUntouched(text);
}

TEST_P(LoopProgram, RisesAndStopsWhereTheBoxFallsSilentDuringATouch) {
  OfAText text{GetParam(), 0};
  auto& control = text.control;
  control.at_move = [&] { control.plc().setLine(control.contacts() == 0); };
  EXPECT_EQ(text.run({4}), kSilent) << text.why() << text.alarm;
  EXPECT_EQ(control.contacts(), 1U) << "no other touch";
  EXPECT_GE(control.position('Z'), kSafeZ_mm - 1e-6);
  EXPECT_EQ(control.crashes(), 0U);
}

// The sphere 0.55 mm nearer to +X, then as far off: a way to the place itself would press by 1.05 mm, or meet nothing.
TEST_P(LoopProgram, PressesByTheOvertravelFromTheContactWhereThePlaceIsOff) {
  for (const double off_mm : {-0.55, 0.45}) {
    OfAText text{GetParam(), 0};
    text.program->set("_pb_sphere_x", 120 + off_mm);
    auto& control = text.control;
    double deepest_mm = 0;
    control.at_wait = [&] {
      const auto pressed = control.scenario().machine().stylusDisplacementAt(control.scenario().now());
      deepest_mm = std::max(deepest_mm, std::abs(pressed[0]));
    };
    EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
    EXPECT_NEAR(deepest_mm, 0.5, 0.03) << off_mm;
  }
}

TEST_P(LoopProgram, EndsWhereTheProbeFindsNothing) {
  OfAText text{GetParam(), 0};
  text.program->set("_pb_sphere_radius", 12.5 + 0.7);
  EXPECT_EQ(text.run({4}), kBeyond) << text.why() << text.alarm;
  EXPECT_EQ(text.control.contacts(), 0U);
}

TEST_P(LoopProgram, StopsWhereTheProbeTouchesOnTheWay) {
  OfAText text{GetParam(), 0};
  text.program->set("_pb_sphere_x", 120 - 14);
  EXPECT_THROW(text.program->call({4}), Alarm) << text.why();
  ASSERT_FALSE(text.control.commanded().empty());
  EXPECT_TRUE(text.control.commanded().back().guarded);
  EXPECT_THAT(text.program->last, testing::AnyOf(testing::HasSubstr("PROBE TOUCHED"), testing::HasSubstr("SETAL")));
  EXPECT_EQ(text.control.contacts(), 1U);
}

// The first move of a call is up or nothing, wherever the machine stands and whatever the caller has active.
TEST_P(LoopProgram, BeginsStraightUpAndNeverDown) {
  for (const double height_mm : {-60.0, -130.0}) {
    OfAText text{GetParam(), 2};
    auto& control = text.control;
    control.move({150, 60, height_mm}, 6000, false);
    control.wait(1);
    std::vector<std::array<double, 3>> stood;
    control.at_move = [&] { stood.push_back({control.position('X'), control.position('Y'), control.position('Z')}); };
    const auto from = control.commanded().size();
    EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
    ASSERT_FALSE(stood.empty());
    const auto first = std::ranges::find(control.commanded().begin() + static_cast<std::ptrdiff_t>(from),
                                         control.commanded().end(), Commanded::Is::move, &Commanded::is);
    ASSERT_NE(first, control.commanded().end());
    if (height_mm < kSafeZ_mm) {
      EXPECT_NEAR(first->to[0], 150, 1e-6);
      EXPECT_NEAR(first->to[1], 60, 1e-6);
      EXPECT_NEAR(first->to[2], kSafeZ_mm, 1e-6);
    } else {
      EXPECT_NEAR(first->to[2], height_mm, 1e-6) << "above the safe height it has nothing to rise to";
    }
  }
}

TEST_P(LoopProgram, EndsBeforeAMoveWhereTheLengthOfTheToolIsNotKnown) {
  OfAText text{GetParam(), 0};
  OfTheKit kit{0};
  for (const unsigned tool : {3U, 150U}) {
    text.control.putIntoSpindle(tool);
    kit.control.putIntoSpindle(tool);
    EXPECT_THROW(text.program->call({4}), Alarm) << tool;
    EXPECT_THROW(kit.run({4}), Alarm) << tool;
  }
  EXPECT_TRUE(text.control.commanded().empty());
  EXPECT_TRUE(kit.control.commanded().empty());
}

// Many a changer moves the axes.
TEST_P(LoopProgram, GoesOnFromWhereAToolChangeHasLeftTheMachine) {
  OfAText text{GetParam(), 0};
  auto& control = text.control;
  text.control.takeTool(2);
  const auto from = control.commanded().size();
  control.at_tool = [&] { control.shove({10, 20, -30}); };
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  const auto& all = control.commanded();
  const auto change = std::ranges::find(all.begin() + static_cast<std::ptrdiff_t>(from), all.end(), Commanded::Is::tool,
                                        &Commanded::is);
  ASSERT_NE(change, all.end());
  const auto next = std::ranges::find(change, all.end(), Commanded::Is::move, &Commanded::is);
  ASSERT_NE(next, all.end());
  EXPECT_NEAR(next->to[2], -30, 1e-6) << "X and Y move at the height of the change";
}

// From one side to the other the head is level on the way, where the tip hangs lowest; a longer tool is taken with the
// head where it is.
TEST_P(LoopProgram, KeepsTheTipAboveEverythingWhereTheHeadSwivelsToItsOtherSide) {
  constexpr double kNominal_mm = 0.1;  // the true head and tools are not the described ones
  auto facts = usualFacts();
  ASSERT_TRUE(facts.swivel_head);
  facts.swivel_head->b.count = 3;
  facts.swivel_head->b.angles_rad = {-45 * kDegree, 0, 45 * kDegree};
  OfTheKit kit{0, 0, facts};
  OfAText text{GetParam(), 0, 0, facts};
  for (Session* session : {static_cast<Session*>(&kit), static_cast<Session*>(&text)}) {
    auto& control = session->control;
    ASSERT_EQ(session->run({4}), kDone) << session->why();
    control.lowest_tip_mm = 1e9;
    ASSERT_EQ(session->run({17}), kDone) << session->why();
    std::set<double> angles;
    for (const auto& one : control.commanded()) {
      if (one.is == Commanded::Is::turn) angles.insert(std::round(one.to[1]));
    }
    EXPECT_EQ(angles, (std::set{-45.0, 0.0, 45.0}));
    EXPECT_GE(control.lowest_tip_mm, kSafeZ_mm - kNominal_mm);
    EXPECT_EQ(control.crashes(), 0U);
  }
}

TEST_P(LoopProgram, OrientsTheSpindleWhereNoAxisDoesAndEndsTheCoolant) {
  for (const auto& [orient, axes, times] : {std::tuple{1, 6, 1}, {0, 6, 0}, {1, 7, 0}}) {
    OfAText text{GetParam(), 2};
    text.program->set("_pb_orient", orient);
    text.program->set("_pb_rotary", axes);
    EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
    EXPECT_EQ(text.control.orientations, times);
    EXPECT_FALSE(text.control.coolant);
  }
}

TEST_P(LoopProgram, TellsNoPlaceToTheBoxWhereItsAxesAreAbsolute) {
  OfAText text{GetParam(), 2};
  text.program->set("_pb_home", 0);
  const auto homed = text.control.registers().value(address::home_commit);
  EXPECT_EQ(text.run({4}), kDone) << text.why() << text.alarm;
  EXPECT_EQ(text.control.registers().value(address::home_commit), homed);
}

class FanucLoop : public testing::Test {
 protected:
  static void expectGivenBack(const FanucProgram& program) {
    const FanucProgram& before = *untouched().program_;
    for (const int group : {4002, 4003, 4005, 4014, 4015})
      EXPECT_EQ(program.modal.at(group), before.modal.at(group)) << group;
    EXPECT_EQ(program.offsets, before.offsets);
  }
  static FanucProgram& programOf(OfAText& text) { return dynamic_cast<FanucProgram&>(*text.program); }

 private:
  struct Untouched {
    OfAText text{"fanuc", 0};
    FanucProgram* program_ = &programOf(text);
  };
  static const Untouched& untouched() {
    static const Untouched one;
    return one;
  }
};

TEST_F(FanucLoop, GivesTheStateOfTheControlBack) {
  OfAText text{"fanuc", 2};
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  expectGivenBack(programOf(text));
  text.program->set("_pb_most_way", 0.3);
  EXPECT_EQ(text.run({4}), kBeyond);
  expectGivenBack(programOf(text));
}

TEST_F(FanucLoop, GivesItBackWhereTheProbeHasTouched) {
  OfAText text{"fanuc", 0};
  text.program->set("_pb_sphere_x", 120 - 14);
  EXPECT_THROW(text.program->call({4}), Alarm);
  expectGivenBack(programOf(text));
}

TEST_F(FanucLoop, KeepsTheValuesOfItsFrameOverAReset) {
  OfAText text{"fanuc", 2};
  text.control.at_stop = [] { throw std::runtime_error{"reset"}; };
  text.program->set("_pb_dry", 1);
  EXPECT_THROW(text.program->call({4}), std::runtime_error);
  EXPECT_EQ(programOf(text).offsets.at(FanucProgram::kFurther + 47)[0], 0);
  text.program->set("_pb_dry", 2);
  text.run({4});
  EXPECT_EQ(programOf(text).offsets.at(FanucProgram::kFurther + 47)[0], 7);
}

TEST_F(FanucLoop, RefusesWhatWouldBendTheWay) {
  for (const auto& [group, code] :
       {std::pair{4011, 51.0}, {4016, 68.0}, {4022, 51.1}, {4006, 20.0}, {4007, 41.0}, {4008, 43.4}}) {
    OfAText text{"fanuc", 0};
    programOf(text).modal[group] = code;
    EXPECT_THROW(text.program->call({4}), Alarm) << group;
    EXPECT_THAT(text.program->last, testing::HasSubstr("CA")) << group;
    EXPECT_TRUE(text.control.commanded().empty()) << group;
  }
  OfAText text{"fanuc", 0};
  programOf(text).local = {0, 5, 0};
  EXPECT_THROW(text.program->call({4}), Alarm);
  EXPECT_THAT(text.program->last, testing::HasSubstr("CANCEL G52 G92"));
  EXPECT_TRUE(text.control.commanded().empty());
}

TEST_F(FanucLoop, ChangesTheToolAlthoughTheCallSaysThatItIsThere) {
  for (const bool builders : {false, true}) {
    OfAText text{"fanuc", 2};
    text.control.move({20, 20, -120}, 6000, false);
    text.control.wait(1);
    text.control.takeTool(2);
    programOf(text).commanded_tool = 1;  // it waits in the changer
    if (builders) text.program->set("_pb_spindle_at", FanucProgram::kToolOfTheBuilder);
    EXPECT_EQ(text.run({4}), kDone) << text.alarm;
    const auto& all = text.control.commanded();
    ASSERT_GT(all.size(), 4U);
    EXPECT_EQ(all[3].is, Commanded::Is::tool);
    EXPECT_EQ(all[3].to[0], 1);
    EXPECT_EQ(all[2].is, Commanded::Is::move);
    EXPECT_GE(all[2].to[2], builders ? -50 : kSafeZ_mm) << "tool 2 is 50 mm longer than the probe";
  }
}

TEST(SiemensLoop, GivesTheStateOfTheControlBack) {
  OfAText text{"siemens", 2};
  auto& program = dynamic_cast<SiemensProgram&>(*text.program);
  const auto before = program.modes;
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  EXPECT_EQ(program.modes, before);
}

TEST(SiemensLoop, HasNoLengthActiveBehindAnotherTool) {
  OfAText text{"siemens", 2};
  text.control.takeTool(2);
  EXPECT_EQ(text.run({4}), kDone) << text.alarm;
  EXPECT_EQ(dynamic_cast<SiemensProgram&>(*text.program).modes.at('D'), 0);
}

TEST(SiemensLoop, RefusesATransformation) {
  OfAText text{"siemens", 0};
  dynamic_cast<SiemensProgram&>(*text.program).transformation = 1;
  EXPECT_THROW(text.program->call({4}), Alarm);
  EXPECT_TRUE(text.control.commanded().empty());
}

INSTANTIATE_TEST_SUITE_P(Of, LoopProgram, testing::Values("fanuc", "siemens"),
                         [](const auto& given) { return given.param; });

}  // namespace
}  // namespace probebox::scenario
