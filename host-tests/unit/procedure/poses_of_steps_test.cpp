#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "obedient_machine.hpp"

// A step begins where its angles and its tool are, as the control says.
namespace probebox::procedure {
namespace {

TEST(RotaryProcedure, RefusesAStepWhoseMachineStandsInAnotherPose) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kCentreline.number, .at = {}, .options = {}});
  for (int k = 0; k < 5; ++k) machine.touch();
  EXPECT_EQ(procedure.progress().step, 5U) << "the first reading is at 0";
  machine.mark(MarkerPhase::begin);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::wrong_pose);
  // What the machine says goes into the recording. A whole turn more is the same place.
  machine.angles_rad = {0, 0, std::numbers::pi / 6 + 1e-3};
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 6U);
  EXPECT_EQ(procedure.recording().touches().back().request.rotary_angles_rad, machine.angles_rad);
  const auto said_rad = machine.angles_rad;
  for (double& angle_rad : machine.angles_rad) angle_rad += 2 * std::numbers::pi;
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 7U);
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(procedure.recording().touches().back().request.rotary_angles_rad[axis], said_rad[axis], 1e-14);
  machine.angles_rad[1] = 0.1;
  machine.mark(MarkerPhase::begin);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::wrong_pose) << "a head or a table that has turned";
  machine.angles_rad = {0, 0, std::nan("")};
  for (std::uint32_t i = 0; i <= Procedure::kMostRepeats; ++i) machine.mark(MarkerPhase::begin);
  EXPECT_EQ(procedure.progress().state, State::refused);
}

// A control whose registers have 0.001 degrees echoes 51.429 for 51.428571.
TEST(RotaryProcedure, TakesTheAngleThatWasAskedForWhereTheControlEchoesItInItsDigits) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kCentreline.number, .at = {}, .options = {.angles = 7}});
  while (procedure.progress().state == State::waiting) {
    const auto wanted_rad = procedure.plan().steps[procedure.progress().step].touch.rotary_angles_rad;
    for (std::size_t k = 0; k < 3; ++k) {
      machine.angles_rad[k] = std::round(wanted_rad[k] * 180e3 / std::numbers::pi) / 180e3 * std::numbers::pi;
    }
    machine.touch();
    EXPECT_EQ(procedure.recording().touches().back().request.rotary_angles_rad, wanted_rad);
  }
  EXPECT_EQ(procedure.recording().touches().size(), 40U);
}

TEST(RotaryProcedure, TakesAnAngleThatWasMeasured) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kCentreline.number, .at = {}, .options = {.angles = 7}});
  for (const double off_rad : {1.1e-5, -1.1e-5, 1e-3}) {
    machine.angles_rad = {0, 0, off_rad};
    machine.touch();
    EXPECT_EQ(procedure.recording().touches().back().request.rotary_angles_rad[2], off_rad);
  }
  machine.angles_rad = {0, 0, 4 * std::numbers::pi + 5e-6};
  machine.touch();
  EXPECT_EQ(procedure.recording().touches().back().request.rotary_angles_rad[2], 0);
}

TEST(RotaryProcedure, RefusesAStepWithAnotherTool) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kAAxisAlignment.number, .at = {}, .options = {}});
  machine.tool = 2;
  machine.mark(MarkerPhase::begin);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::wrong_tool);
  machine.tool = 1;
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 1U);
}

}  // namespace
}  // namespace probebox::procedure
