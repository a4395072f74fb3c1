#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <initializer_list>
#include <set>
#include <span>

#include "session.hpp"

// Kinds of steps beside touches, jogs and holds, each in a run of its own.
namespace probebox::scenario {
namespace {

class LoopKinds : public testing::TestWithParam<std::string> {};

// Scans by arcs and by chords, touches by the shank, C turned until the ball touches, a plate in two mounts. All but
// the scans need the delay.
constexpr Asked kDelay{.method = 4}, kStepped{.method = 26}, kContour{.method = 27}, kShank{.method = 17, .read_by = 2},
    kContacts{.method = 23, .contacts = 1}, kMounts{.method = 15, .axis = 5, .mounts = 2},
    kTurningAxis{.method = 15, .axis = 6};
// The table tilted, C at 0 and half a turn; and a plate on it.
constexpr Asked kTablePivot{.method = 16}, kPlateOnB{.method = 15, .axis = 5}, kHead{.method = 22},
    kBallsOverTheHead{.method = 15, .axis = 5, .read_by = 1};

// With the delay in force, as far as the run needs it.
void expectTheKitsMoves(const std::string& dialect, const std::vector<Asked>& runs, char table,
                        const std::function<void(OfAText&)>& then) {
  OfTheKit kit{0, table};
  OfAText text{dialect, 0, table};
  kit.standByThePlate();
  text.standByThePlate();
  for (const auto& run : runs) {
    const auto from = withoutIdleChanges(kit.control.commanded()).size();
    ASSERT_EQ(kit.run(run), run.came) << "method " << run.method << ", " << kit.why();
    ASSERT_EQ(text.run(run), run.came) << "method " << run.method << ", " << text.why() << text.alarm;
    EXPECT_EQ(text.control.registers().value(address::calibration_method), run.method);
    // Behind its contacts that goes where they were, which noise has a part in.
    expectSame(withoutIdleChanges(kit.control.commanded()), withoutIdleChanges(text.control.commanded()), from,
               run.contacts != 0 ? 0.02 : 1e-6);
    ASSERT_FALSE(testing::Test::HasFatalFailure()) << "method " << run.method;
  }
  EXPECT_EQ(text.control.crashes(), 0U);
  EXPECT_EQ(kit.control.crashes(), 0U);
  EXPECT_EQ(text.control.plc().refusedWrites(), 0U);
  EXPECT_EQ(kit.mounted, text.mounted);
  then(text);
}

std::size_t countOf(const Control& control, Commanded::Is what) {
  return static_cast<std::size_t>(std::ranges::count(control.commanded(), what, &Commanded::is));
}

std::set<double> tiltsOf(const Control& control, char word) {
  std::set<double> tilts;
  for (const auto& one : control.commanded()) {
    if (one.is == Commanded::Is::turn) tilts.insert(one.to.at(static_cast<std::size_t>(word - 'A')));
  }
  return tilts;
}

TEST_P(LoopKinds, ScansInContactAllTheWay) {
  for (const auto& run : {kStepped, kContour}) {
    expectTheKitsMoves(GetParam(), {run}, 0, [&](OfAText& text) {
      const bool arcs = run.method == kStepped.method;
      EXPECT_EQ(countOf(text.control, Commanded::Is::arc), arcs ? 6U * 7U : 0U) << "three speeds, two senses";
      EXPECT_EQ(text.control.contacts(), 6U) << "one a scan";
      auto& box = text.control.registers();
      const double truth_ms = 1e3 * text.control.scenario().truth().tau_s[0];
      const double sd_ms = box.value(address::delay_sd_f32);
      EXPECT_GT(sd_ms, 0);
      EXPECT_LT(sd_ms, 0.01);
      EXPECT_LT(std::abs(box.value(address::delay_f32) - truth_ms), 4 * sd_ms);
    });
  }
}

TEST_P(LoopKinds, TouchesByTheShank) {
  expectTheKitsMoves(GetParam(), {kDelay, kShank}, 0, [](OfAText& text) {
    const auto& stylus = text.control.scenario().machine().stylus();
    std::size_t by_shank = 0;
    for (std::uint64_t i = 0; i < stylus.contactCount(); ++i) {
      const auto* contact = stylus.contact(i);
      by_shank += contact != nullptr && contact->lever == worldOfTheLoop().probe_spindle.shank->lever ? 1U : 0U;
    }
    EXPECT_GT(by_shank, 10U);
  });
}

TEST_P(LoopKinds, TurnsCUntilTheBallTouches) {
  expectTheKitsMoves(GetParam(), {kDelay, kContacts}, 0, [](OfAText& text) {
    EXPECT_EQ(countOf(text.control, Commanded::Is::turn_until_touched), 2U);
    auto& box = text.control.registers();
    // Where C is at the ball's height, less the offset of the stylus: machine.toml says the same. Screws are warm.
    EXPECT_NEAR(box.value(address::centreline_here), 330.17, 0.03);
    EXPECT_NEAR(box.value(static_cast<std::uint16_t>(address::centreline_here + 2)), 199.942, 0.03);
  });
}

TEST(LoopKit, HasThePlatePutIntoEachMount) {
  OfTheKit kit{0, 'B'};
  kit.standByThePlate();
  for (const auto& run : {kDelay, kMounts}) ASSERT_EQ(kit.run(run), kDone) << run.method << ": " << kit.why();
  EXPECT_THAT(kit.run(kMounts), testing::AnyOf(kDone, kNotAccepted)) << "screws are warmer; " << kit.why();
  EXPECT_EQ(kit.mounted, (std::vector{2, 1, 2, 1})) << "it is in the first one at the beginning and the end";
  EXPECT_EQ(kit.control.crashes(), 0U);
}

TEST_P(LoopKinds, HasThePlatePutIntoAnotherMount) {
  expectTheKitsMoves(GetParam(), {kDelay, kMounts}, 'B', [](OfAText& text) {
    EXPECT_EQ(text.mounted, (std::vector{2, 1}));
  });
}

// The longest run: 135 touches, with which a recording is still not full.
TEST_P(LoopKinds, ReadsTheTurningAxisByManyTouches) {
  expectTheKitsMoves(GetParam(), {kDelay, kTurningAxis}, 0,
                     [](OfAText& text) { EXPECT_GE(text.control.contacts(), 135U); });
}

TEST_P(LoopKinds, KnowsThreeMounts) {
  for (const std::uint16_t mount : {std::uint16_t{3}, std::uint16_t{4}}) {
    OfAText text{GetParam(), 0};
    text.standByThePlate();
    text.control.plc().feign(gcode::loop::placeRead("probebox.step-mount")->word, mount);
    EXPECT_EQ(text.run(kDelay), mount == 3 ? kDone : kBeyond) << text.why() << text.alarm;
    EXPECT_EQ(text.mounted, (mount == 3 ? std::vector{3, 1} : std::vector<int>{}));
  }
}

TEST_P(LoopKinds, GoesToBallsOfATiltedTable) {
  for (const char word : {'A', 'B'}) {
    expectTheKitsMoves(GetParam(), {kDelay, kTablePivot, kPlateOnB}, word, [&](OfAText& text) {
      EXPECT_THAT(tiltsOf(text.control, word), testing::Contains(testing::DoubleNear(-90, 1e-9)));
    });
  }
}

TEST_P(LoopKinds, HoldsASensorHeadOverBallsOfATiltedTable) {
  for (const char word : {'A', 'B'}) {
    expectTheKitsMoves(GetParam(), {kHead, kBallsOverTheHead}, word, [&](OfAText& text) {
      EXPECT_THAT(tiltsOf(text.control, word), testing::Contains(testing::DoubleNear(-90, 1e-9)));
      EXPECT_EQ(text.control.contacts(), 0U);
    });
  }
}

TEST_P(LoopKinds, TiltsNoTableOfWhichThePlacesSayNothing) {
  OfAText text{GetParam(), 0, 'B'};
  ASSERT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
  text.program->set("_pb_table_word", 0);
  EXPECT_EQ(text.run(kTablePivot), kBeyond) << text.why() << text.alarm;
  text.program->set("_pb_table_word", 2);
  EXPECT_EQ(text.run({17}), kBeyond) << "B is no head; " << text.why() << text.alarm;
}

TEST_P(LoopKinds, GoesTheWayOfEveryKindAboveEverything) {
  for (const auto& [run, table] : std::initializer_list<std::pair<Asked, char>>{
           {kStepped, 0}, {kContour, 0}, {kShank, 0}, {kContacts, 0}, {kMounts, 'B'}, {kTablePivot, 'B'}}) {
    OfAText text{GetParam(), 0, table};
    const bool scans = run.method == kStepped.method || run.method == kContour.method;
    if (!scans) {
      ASSERT_EQ(text.run(kDelay), kDone) << text.why() << text.alarm;
    }
    text.program->set("_pb_dry", 2);
    auto& control = text.control;
    text.standByThePlate();
    const auto contacts = control.contacts();
    const auto from = control.commanded().size();
    control.lowest_mm = 1e9;
    EXPECT_EQ(text.run(run), kDone) << run.method << ": " << text.why() << text.alarm;
    EXPECT_EQ(control.registers().value(address::step_state), 6) << "aborted";
    EXPECT_GE(control.lowest_mm, kSafeZ_mm - 1e-6) << run.method;
    EXPECT_EQ(control.contacts(), contacts) << run.method;
    EXPECT_EQ(control.crashes(), 0U) << run.method;
    EXPECT_TRUE(text.mounted.empty()) << "nobody has to move the plate for it";
    for (const auto& one : std::span{control.commanded()}.subspan(from)) {
      EXPECT_NE(one.is, Commanded::Is::arc) << "nothing stops it where the probe touches";
      EXPECT_TRUE(one.is != Commanded::Is::move || one.guarded);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, LoopKinds, testing::Values("fanuc", "siemens"),
                         [](const auto& given) { return given.param; });

}  // namespace
}  // namespace probebox::scenario
