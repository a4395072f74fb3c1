#include "firmware/procedure/procedure.hpp"

#include <gtest/gtest.h>
#include <set>

namespace probebox::procedure {
namespace {

constexpr TickMap kLocked{.tick = {},
                          .at = {},
                          .period_q32_ns = std::int64_t{1'000'000} << 32,
                          .sigma_ns = 500,
                          .state = ClockState::locked,
                          .holdover_ms = 0};

// A machine that does what it is asked for, one step at a time.
class ObedientMachine {
 public:
  explicit ObedientMachine(Procedure& procedure) : procedure_{procedure} {}

  void mark(MarkerPhase phase) {
    const auto& progress = procedure_.progress();
    procedure_.mark(Marker{.procedure = progress.run, .step = progress.step, .phase = phase, .at = monoTime(now_ns_)},
                    kLocked);
  }
  void touch(bool clipped = false) {
    mark(MarkerPhase::begin);
    for (int i = 0; i < 10; ++i) {
      now_ns_ += 1'000'000;
      for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        procedure_.push(Count{.axis = axis, .sequence = 0, .counts = i, .at = monoTime(now_ns_)});
      }
      procedure_.push(Deflection{.sequence = 0, .channels_nm = {}, .clipped = clipped, .at = monoTime(now_ns_)});
    }
    mark(MarkerPhase::end);
  }
  void wait(Nanoseconds duration) {
    now_ns_ += duration.count();
    procedure_.advance(monoTime(now_ns_));
  }

 private:
  Procedure& procedure_;
  std::int64_t now_ns_{};
};

class MultiSpeedProcedure : public testing::Test {
 protected:
  Procedure procedure{MultiSpeedOptions{}, capture::Capacity{}};
  ObedientMachine machine{procedure};

  void start(std::uint32_t run) {
    procedure.start({.run = run, .method = static_cast<std::uint16_t>(Method::delay_multi_speed), .at = {}});
  }
  void touchAll() {
    while (procedure.progress().state == State::waiting) machine.touch();
  }
};

TEST_F(MultiSpeedProcedure, AsksForFivePointsAtEachSpeed) {
  const Plan& plan = procedure.plan();
  ASSERT_EQ(plan.step_count, 25U);
  std::set<double> speeds;
  std::set<std::array<double, 3>> normals;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    speeds.insert(plan.steps[i].touch.retract_speed_mm_s);
    normals.insert(plan.steps[i].touch.outward_normal);
    EXPECT_EQ(plan.steps[i].touch.step, i);
  }
  EXPECT_EQ(speeds, (std::set<double>{5, 10, 20, 30, 40}));
  EXPECT_EQ(normals.size(), 5U);
  EXPECT_EQ(promptFor(plan, 6), "touch 7 of 25: -X side of the sphere, 0.5 mm deep, retract at 10 mm/s");
}

TEST_F(MultiSpeedProcedure, HandsOverTheRecordingOnceWhenAllStepsAreDone) {
  start(7);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
  EXPECT_TRUE(procedure.takeReadyToSolve());
  EXPECT_FALSE(procedure.takeReadyToSolve());
  EXPECT_EQ(procedure.recording().touches().size(), 25U);
}

TEST_F(MultiSpeedProcedure, ProposesOrRefusesWithTheWorkersAnswerToThisRunOnly) {
  start(7);
  touchAll();
  procedure.solved({.run = 6, .refused = true, .result_id = 1, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::solving);
  procedure.solved({.run = 7, .refused = false, .result_id = 12, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::proposed);
  EXPECT_EQ(procedure.progress().result_id, 12U);
}

TEST_F(MultiSpeedProcedure, KeepsTheRecordingWhileTheWorkerReadsIt) {
  start(7);
  touchAll();
  start(8);
  procedure.abort({.run = 7, .at = {}});
  EXPECT_EQ(procedure.progress().run, 7U);
  EXPECT_EQ(procedure.recording().touches().size(), 25U);
}

TEST_F(MultiSpeedProcedure, AsksForAFaultyStepAgainAndRefusesAfterTooManyRepeats) {
  start(1);
  machine.touch();
  machine.touch(/*clipped=*/true);
  EXPECT_EQ(procedure.progress().step, 1U);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::probe_clipped);
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 2U);
  EXPECT_EQ(procedure.progress().repeats, 0U);
  for (std::uint32_t i = 0; i <= Procedure::kMostRepeats; ++i) machine.touch(/*clipped=*/true);
  EXPECT_EQ(procedure.progress().state, State::refused);
}

TEST_F(MultiSpeedProcedure, StartsAStepAnewWhenTheMachineBeginsItAgainOrGivesItUp) {
  start(1);
  machine.mark(MarkerPhase::begin);
  machine.mark(MarkerPhase::begin);
  machine.mark(MarkerPhase::abandon);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  machine.touch();
  ASSERT_EQ(procedure.recording().touches().size(), 1U);
  EXPECT_EQ(procedure.recording().machineRowCount(), 10U);
}

TEST_F(MultiSpeedProcedure, AsksAgainWhenTheEndOfAStepNeverComes) {
  start(1);
  machine.mark(MarkerPhase::begin);
  machine.wait(Procedure::kStepTimeout - Nanoseconds{1});
  EXPECT_EQ(procedure.progress().state, State::running);
  machine.wait(Nanoseconds{1});
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_TRUE(procedure.progress().timed_out);
}

TEST_F(MultiSpeedProcedure, CountsMarkersThatBelongNowhereAndGoesOn) {
  procedure.mark(Marker{.procedure = 9, .step = 0, .phase = MarkerPhase::begin}, kLocked);
  start(1);
  procedure.mark(Marker{.procedure = 1, .step = 5, .phase = MarkerPhase::begin}, kLocked);
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(procedure.strayMarkers(), 3U);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
}

TEST_F(MultiSpeedProcedure, AbortsOnRequestAndCanStartAfresh) {
  start(1);
  machine.touch();
  procedure.abort({.run = 1, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::aborted);
  start(2);
  EXPECT_EQ(procedure.progress().step, 0U);
  EXPECT_EQ(procedure.recording().touches().size(), 0U);
}

}  // namespace
}  // namespace probebox::procedure
