#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "multi_speed_procedure.hpp"
#include "obedient_machine.hpp"

// Positions about two zeros do not go together.
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
