#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "multi_speed_procedure.hpp"
#include "obedient_machine.hpp"

// Positions about two zeros do not go together, nor those that two results about a screw correct.
namespace probebox::procedure {
namespace {

class RunAboutTwoZeros : public MultiSpeedProcedure {};

TEST_F(RunAboutTwoZeros, IsRefusedWhenAnAxisCountsFromElsewhereThanInTheTouchesBefore) {
  for (const auto phase : {MarkerPhase::begin, MarkerPhase::end}) {
    start(1 + static_cast<std::uint32_t>(phase));
    machine.touch();
    if (phase == MarkerPhase::end) machine.mark(MarkerPhase::begin);
    ++machine.zeros.breaks[2];
    machine.mark(phase);
    EXPECT_EQ(procedure.progress().state, State::refused);
    EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::zero_lost);
    EXPECT_EQ(procedure.recording().touches().size(), 1U);
    machine.zeros = {};
  }
}

TEST_F(RunAboutTwoZeros, RepeatsItsFirstTouchWhenAnAxisCountsFromElsewhereInIt) {
  start(1);
  machine.mark(MarkerPhase::begin);
  ++machine.zeros.breaks[0];
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 1U) << "begun again, it counts";
  procedure.abort({.run = 1, .at = {}});
  start(2);
  machine.mark(MarkerPhase::begin);
  ++machine.zeros.breaks[0];
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::source_lost);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
}

TEST_F(RunAboutTwoZeros, GoesOnWithADryRunWhateverTheAxesCount) {
  start(1);
  for (int i = 0; i < 2; ++i) machine.mark(MarkerPhase::pass);
  ++machine.zeros.breaks[0];
  while (procedure.progress().passing) machine.mark(MarkerPhase::pass);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
}

// How far it went is what a delay needs.
TEST_F(RunAboutTwoZeros, DoesNotMindThatAnAxisIsHomed) {
  start(1);
  machine.touch();
  machine.zeros.offset_mm[0] = 12.5;
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
}

// The part of a warm screw is taken out of positions that are known.
TEST_F(RunAboutTwoZeros, IsRefusedWhenAnAxisWithAWarmScrewIsHomedInIt) {
  machine.zeros.extension_mm[0] = 0.02;
  start(1);
  machine.touch();
  machine.zeros.offset_mm[0] = 12.5;
  machine.touch();
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::zero_lost);
  start(2);
  machine.touch();
  machine.zeros.offset_mm[0] = 12.6;
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving) << "0.1 mm elsewhere a screw is no longer";
}

TEST_F(RunAboutTwoZeros, IsRefusedWhenAnotherResultAboutAScrewComesIntoForceInIt) {
  start(1);
  machine.touch();
  ++machine.zeros.screw_results[1];
  machine.mark(MarkerPhase::begin);
  EXPECT_EQ(procedure.progress().state, State::refused);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::screw_changed);
  start(2);
  machine.mark(MarkerPhase::begin);
  ++machine.zeros.screw_results[1];
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::screw_changed);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving) << "with nothing before it";
}

TEST(RunForAPlace, IsRefusedWhenAnAxisIsHomedAnewInIt) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  machine.zeros.offset_mm = {1, 2, 3};
  const auto start = [&](std::uint32_t run) {
    procedure.start({.run = run, .method = kCentreline.number, .at = {}, .options = {}}, {}, machine.zeros);
  };
  const auto touchAsAsked = [&] {
    machine.angles_rad = procedure.plan().steps[procedure.progress().step].touch.rotary_angles_rad;
    machine.touch();
  };
  start(1);
  machine.zeros.offset_mm[1] = 2.1;
  touchAsAsked();
  EXPECT_EQ(procedure.progress().step, 1U) << "there is nothing yet that it does not go with";
  EXPECT_EQ(procedure.recording().offset_mm()[1], 2.1);
  machine.zeros.offset_mm[1] = 2.1005;
  touchAsAsked();
  EXPECT_EQ(procedure.progress().step, 2U) << "by less than a micrometre";
  machine.zeros.offset_mm[1] = 2.103;
  touchAsAsked();
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::zero_lost);
  start(2);
  machine.zeros.offset_mm[0].reset();
  touchAsAsked();
  EXPECT_EQ(procedure.progress().state, State::refused) << "before the first touch too: where it is nobody knows";
}

// The angle of a screw is that of a machine position.
class RunAboutAScrew : public testing::TestWithParam<const LiveMethod*> {
 protected:
  RunAboutAScrew() {
    machine.zeros.offset_mm = {1, std::nullopt, std::nullopt};
    machine.row_ns = 10'000'000'000;
    start(1);
  }
  void start(std::uint32_t run) {
    procedure.start({.run = run,
                     .method = GetParam()->number,
                     .at = {},
                     .options = {.speed_count = 1, .speeds_mm_s = {0.5}, .axis = 1, .travel_mm = 40}},
                    {}, machine.zeros);
  }
  const Progress& progress() const { return procedure.progress(); }

  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
};

TEST_P(RunAboutAScrew, IsRefusedWhenItsAxisHasNoZeroAnyMore) {
  machine.mark(MarkerPhase::begin);
  machine.zeros.offset_mm[0].reset();
  ++machine.zeros.breaks[0];
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(progress().state, State::refused);
  EXPECT_EQ(progress().last_fault, capture::TouchFault::zero_lost);
}

TEST_P(RunAboutAScrew, BeginsAnewFromTheZeroThatItsAxisWasGiven) {
  machine.mark(MarkerPhase::begin);
  machine.zeros.offset_mm[0] = 7;
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(progress().state, State::waiting) << "positions before it was homed are not those after";
  machine.touch();
  EXPECT_EQ(progress().state, State::solving);
  EXPECT_EQ(procedure.recording().offset_mm()[0], 7);
}

TEST_P(RunAboutAScrew, DoesNotMindWhereTheOtherAxesAre) {
  machine.mark(MarkerPhase::begin);
  machine.zeros.offset_mm[1] = 3;
  machine.touch();
  EXPECT_EQ(progress().state, State::solving);
}

// Motor positions hold nothing of it.
TEST_P(RunAboutAScrew, DoesNotMindAnotherResultAboutIt) {
  machine.zeros.extension_mm[0] = 0.02;
  machine.mark(MarkerPhase::begin);
  ++machine.zeros.screw_results[0];
  machine.touch();
  EXPECT_EQ(progress().state, State::solving);
}

INSTANTIATE_TEST_SUITE_P(OfMethods, RunAboutAScrew, testing::Values(&kScrewCalibration, &kScrewReference),
                         [](const auto& named) { return named.param == &kScrewReference ? "Rest" : "Sweep"; });

// It is what finds an encoder that is wired otherwise than described.
TEST(SelftestAboutTwoZeros, GoesOn) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kSelftest.number, .at = {}});
  while (procedure.progress().state == State::waiting) {
    ++machine.zeros.breaks[1];
    machine.touch();
  }
  EXPECT_EQ(procedure.progress().state, State::solving);
}

}  // namespace
}  // namespace probebox::procedure
