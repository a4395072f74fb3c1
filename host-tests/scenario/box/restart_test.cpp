#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <string>

#include "host-tests/emulation/boot.hpp"
#include "host-tests/support/temporary_folder.hpp"

// The box dies in the middle of a procedure, and another one begins with what is in the store.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using messages::ErrorCode;
using ::testing::HasSubstr;

world::Config warmingSlowly() {
  auto config = warmingWorld();
  for (auto& screw : config.screws) screw->time_constant_s = 60;
  return config;
}

class Restart : public testing::Test {
 protected:
  Restart() { boot_.emplace(office_, file_); }

  Scenario& scenario() { return office_.scenario(); }
  const published::Snapshot& served() { return scenario().state().snapshot; }

  // Nobody says anything before it dies: no signal, no last word.
  void dieAndComeBack() {
    boot_.reset();
    boot_.emplace(office_, file_);
    restored_ = boot_->restored();
    office_.restartBox(restored_);
    received_before_ = scenario().recorded().received;
    lost_before_ = scenario().recorded().lost_samples;
  }

  // What the store had of the correction that was served last.
  std::array<double, kLinearAxes> kept_mm() const {
    const auto found = std::ranges::find_if(
        restored_, [](const Event& event) { return std::holds_alternative<AppliedRestored>(event); });
    return found == restored_.end() ? std::array<double, kLinearAxes>{}
                                    : std::get<AppliedRestored>(*found).correction_mm;
  }

  // Until the touch of this step is under way.
  bool comesTo(std::uint32_t step) {
    return scenario().runUntil(
        [&] {
          const auto& progress = scenario().state().procedure;
          return progress.step == step && progress.state == procedure::State::running &&
                 scenario().controller().activity() == world::Activity::retracting;
        },
        60s);
  }

  // The controller's script at the end of a step of this run.
  app::Reply endOf(std::uint32_t run, std::uint32_t step) {
    return boot_->ask<messages::PostMarker>(
        {.procedure = run, .step = step, .phase = messages::StepPhase::end, .at_rest = true});
  }

  void expectNothingLost(const VirtualHost& host) {
    const auto& recorded = scenario().recorded();
    const auto& lost = scenario().state().lost;
    EXPECT_TRUE(recorded.contiguous);
    EXPECT_EQ(lost.sync_edges + lost.line_edges + lost.counts + lost.deflections + lost.queue_events, 0U);
    EXPECT_EQ(served().ledger.lost_at_source + served().ledger.lost_in_queue, 0U);
    EXPECT_EQ(recorded.lost_samples, lost_before_);
    const auto given = recorded.received - received_before_;
    EXPECT_GE(served().ledger.produced, given);
    EXPECT_LE(served().ledger.produced, given + 256) << "the block that is being filled";
    EXPECT_EQ(host.received(), given) << "since the host connected, which was at once";
    EXPECT_EQ(host.declaredLost() + host.lostTriggers() + host.faults(), 0U);
  }

  const support::TemporaryFolder folder_;
  const std::string file_ = folder_.file("results.db");
  Office office_{2U << 20U, stream::TriggerHistory::kKept, warmingSlowly()};
  std::optional<Boot> boot_;
  std::vector<Event> restored_;
  std::uint64_t received_before_{};
  std::uint64_t lost_before_{};
};

TEST_F(Restart, InMidCalibrationLosesTheRunAndTheReferencesAndNothingElse) {
  boot_->run(30s);
  ASSERT_NE(boot_->start("delay-multi-speed"), 0U);
  const auto first = boot_->finish();
  ASSERT_TRUE(first && boot_->accept(*first));
  boot_->run(1s);
  ASSERT_TRUE(served().valid);
  const auto run = boot_->start("delay-multi-speed");
  ASSERT_NE(run, 0U);
  ASSERT_TRUE(comesTo(3));
  boot_->run(100ms);
  const auto applied_mm = served().correction_mm;
  ASSERT_LT(applied_mm[0], -0.01) << "there is something that stands";
  const auto abandoned = scenario().controller().abandonedSteps();

  dieAndComeBack();
  auto& host = office_.add();

  // The run is gone, and who asks is told so; the script's next word is refused by name, at once.
  EXPECT_EQ(boot_->procedure().run, 0U);
  EXPECT_EQ(boot_->procedure().state, RunState::idle);
  const auto refusal = endOf(run, 3);
  EXPECT_EQ(refusal.code, ErrorCode::wrong_state);

  // No axis has a reference; what is served stands where the machine stands, and says that it is not valid.
  scenario().run(20ms);
  for (const auto& axis : served().axes) EXPECT_FALSE(axis.referenced);
  EXPECT_FALSE(served().valid);
  EXPECT_EQ(served().correction_mm, kept_mm());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(kept_mm()[i], applied_mm[i], 0.5e-3) << "XYZ"[i];
  EXPECT_EQ(served().delay.result_id, *first) << "accepted results are in force again";

  // The controller sees that its run has gone, drives off and homes; then all is well again.
  boot_->run(5s);
  EXPECT_EQ(scenario().controller().abandonedSteps(), abandoned + 1);
  EXPECT_EQ(scenario().machine().crashes(), 0U);
  EXPECT_TRUE(served().referenced && served().valid);

  ASSERT_NE(boot_->start("delay-multi-speed"), 0U);
  const auto second = boot_->finish();
  ASSERT_TRUE(second);
  EXPECT_GT(*second, *first) << "the run that died left no result";
  EXPECT_TRUE(boot_->accept(*second));
  boot_->run(1s);
  const auto& delay = served().delay;
  EXPECT_EQ(delay.result_id, *second);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(std::abs(delay.tau_s[i] - scenario().truth().tau_s[i]), 5 * delay.sd_s[i]);
  expectNothingLost(host);
}

}  // namespace
}  // namespace probebox::scenario
