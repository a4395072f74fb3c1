#include <chrono>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "running_daemon.hpp"

namespace probebox::app {
namespace {

TEST_F(RunningDaemon, CalibratesTheDelayByTouchesAndRestoresItAfterARestart) {
  startForRuns();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto status = host->calibrate();
  ASSERT_EQ(status.state, RunState::proposed) << status.refusal;

  const auto results = host->ask<messages::ListResults>().results;
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].id, status.result_id);
  EXPECT_EQ(results[0].state, messages::ResultState::proposed);
  const auto& tau = results[0].values.front();
  ASSERT_EQ(tau.key, "tau_s");
  const auto& delays = descriptions.world->delays;
  const double truth = delays.tau_machine_s[0] - delays.tau_probe_s;
  EXPECT_GT(tau.sd, 1e-7);
  EXPECT_LT(tau.sd, 5e-5);
  EXPECT_LT(std::abs(tau.value - truth), 5 * tau.sd);

  EXPECT_FALSE(host->ask<messages::Corrections>().delay.calibrated);  // a result changes nothing by itself
  host->ask<messages::AcceptResult>({.id = status.result_id, .by = "somebody"});
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay.calibrated; }));
  EXPECT_EQ(host->ask<messages::Corrections>().delay.tau_s[2], tau.value);

  host.reset();
  daemon.reset();
  start();
  host = connect();
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay.calibrated; }));
  EXPECT_EQ(host->ask<messages::Corrections>().delay.tau_s[0], tau.value);
}

TEST_F(RunningDaemon, SaysWhatIsDueAlsoAfterARestart) {
  overrule("machine.toml", "every_days = 30", "every_days = 30\ncutting_h = 0.01");
  startForRuns();
  auto host = connect();
  const auto due = [&] { return host->ask<messages::Status>().due; };
  ASSERT_EQ(due().size(), 2U);
  EXPECT_EQ(due()[0].state, published::DueState::not_measured);

  ASSERT_TRUE(host->waitForLock());
  const auto status = host->calibrate();
  ASSERT_EQ(status.state, RunState::proposed) << status.refusal;
  host->ask<messages::AcceptResult>({.id = status.result_id, .by = "somebody"});
  ASSERT_TRUE(host->eventually([&] { return due()[0].state == published::DueState::good; }));
  EXPECT_EQ(due()[0].name, "delay");
  EXPECT_EQ(due()[0].result_id, status.result_id);
  EXPECT_NEAR(due()[0].remaining_s, 30 * 86'400, 600);
  EXPECT_EQ(due()[0].remaining_cutting_s, 36);
  EXPECT_EQ(due()[1].state, published::DueState::not_measured);

  host->ask<messages::SetInhibit>({.active = true});
  ASSERT_TRUE(host->eventually([&] { return due()[0].state == published::DueState::overdue; }));
  host->ask<messages::SetInhibit>({.active = false});
  host.reset();
  daemon.reset();
  start();
  host = connect();
  ASSERT_TRUE(host->eventually([&] { return due()[0].result_id == status.result_id; }));
  EXPECT_EQ(due()[0].state, published::DueState::overdue);
  EXPECT_LT(due()[0].remaining_cutting_s, 0);
}

TEST_F(RunningDaemon, LetsAnAcceptedResultWaitForTheEndOfACut) {
  startForRuns();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto status = host->calibrate();
  ASSERT_EQ(status.state, RunState::proposed) << status.refusal;
  const auto calibrated = [&] { return host->ask<messages::Corrections>().delay.calibrated; };

  host->ask<messages::SetInhibit>({.active = true});
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().inhibited; }));
  const auto accepted = host->ask<messages::AcceptResult>({.id = status.result_id, .by = "a machinist"});
  EXPECT_EQ(accepted.state, messages::ResultState::accepted);
  EXPECT_TRUE(accepted.waiting_for_cut);
  EXPECT_FALSE(calibrated());
  EXPECT_THAT(host->refusal<messages::EnableSources>({.mask = 1}).what, testing::HasSubstr("cut"));
  host->ask<messages::SetInhibit>({.active = false});
  ASSERT_TRUE(host->eventually(calibrated)) << "it comes into force by itself";

  const auto back = host->ask<messages::RollbackResult>({.id = 0, .subject = "delay", .by = "somebody else"});
  EXPECT_EQ(back.retired_id, status.result_id);
  EXPECT_EQ(back.active_id, 0U);
  ASSERT_TRUE(host->eventually([&] { return !calibrated(); }));
  std::vector<messages::ResultState> states;
  for (const auto& transition : host->ask<messages::ResultHistory>().transitions) states.push_back(transition.state);
  using State = messages::ResultState;
  EXPECT_THAT(states, testing::ElementsAre(State::proposed, State::accepted, State::active, State::retired));
}

TEST_F(RunningDaemon, CorrectsScrewsThatWarmUpOnceTheMachineIsHomed) {
  start();
  auto host = connect();
  messages::Corrections::Answer now;
  ASSERT_TRUE(host->eventually([&] {
    now = host->ask<messages::Corrections>();
    return now.valid && std::abs(now.correction_mm[0]) > 1e-5;
  }));
  EXPECT_TRUE(now.referenced);
  EXPECT_EQ(now.mask, 1);
  EXPECT_LT(now.correction_mm[0], 0) << "a screw that is too long pushes the nut ahead";
  ASSERT_EQ(now.axes.size(), 3U);
  EXPECT_GT(now.axes[0].screw.extension_um, 0);
  host->ask<messages::EnableSources>({.mask = 0});
  ASSERT_TRUE(host->eventually([&] {
    now = host->ask<messages::Corrections>();
    return now.mask == 0 && now.correction_mm == std::array<double, 3>{};
  })) << "what was added is taken back";
}

TEST_F(RunningDaemon, HomesNoAxisOutsideOfItsTravel) {
  start();
  auto host = connect();
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().referenced; }));
  const auto refusal = host->refusal<messages::HomeAxes>({.axes = 7, .position_mm = {100, 100, 1e6}});
  EXPECT_EQ(refusal.code, messages::ErrorCode::refused);
  EXPECT_THAT(refusal.what, testing::AllOf(testing::HasSubstr("axis Z"), testing::HasSubstr("-400 mm to 50 mm")));
  for (const auto& axis : host->ask<messages::Corrections>().axes)
    EXPECT_LT(std::abs(axis.position_mm), 500) << "nothing was homed";
}

TEST_F(RunningDaemon, StreamsSamplesWithALedgerThatBalancesAtEveryHeartbeat) {
  start();
  Balances balances;
  auto host = connect(&balances);
  ASSERT_TRUE(host->waitForLock());
  host->client().start({});
  ASSERT_TRUE(host->eventually([&] { return balances.heartbeats > 20 && balances.samples > 2000; }));
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(closing.account.total(), closing.produced);
  EXPECT_EQ(balances.exact, balances.heartbeats);
}

// What the stream tells of triggers is what the corrections' answer, and so the registers, tell of the last one.
TEST_F(RunningDaemon, StreamsEveryTriggerWithThePositionThatTheRegistersHave) {
  struct Triggers : link::StreamListener {
    void onTrigger(const messages::Trigger& trigger) override { all.push_back(trigger); }
    void onTriggerGap(const messages::TriggerGap& gap) override { lost += gap.count; }
    std::vector<messages::Trigger> all;
    std::uint64_t lost{};
  } triggers;
  startForRuns();
  auto host = connect(&triggers);
  ASSERT_TRUE(host->waitForLock());
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::ProcedureStatus>().referenced; }));
  messages::Start start;
  start.triggers = true;
  host->client().start(start);
  ASSERT_EQ(host->calibrate().state, RunState::proposed);
  const auto last = host->ask<messages::Corrections>().last_trigger;
  ASSERT_GT(last.number, 20U);
  ASSERT_TRUE(host->eventually([&] { return !triggers.all.empty() && triggers.all.back().number >= last.number; }));
  EXPECT_EQ(triggers.lost, 0U);
  for (std::size_t k = 0; k < triggers.all.size(); ++k) {
    const auto& trigger = triggers.all[k];
    EXPECT_EQ(trigger.number, triggers.all.front().number + k);
    EXPECT_EQ(trigger.has_position, 7U);
    if (trigger.number != last.number) continue;
    EXPECT_EQ(trigger.position_mm, last.position_mm);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_EQ(trigger.correction_mm[axis], last.served.correction_nm[axis] * 1e-6);
    EXPECT_EQ(trigger.sequence, last.served.sequence);
  }
  host->finish();
  EXPECT_TRUE(host->client().reader().triggers().exact());
}

TEST_F(RunningDaemon, MeasuresHowLateItStampsItsOwnPulses) {
  start();
  auto host = connect();
  const auto late = host->ask<messages::LoopBack>({.pulses = 2000});
  EXPECT_EQ(late.pulses, 2000U);
  EXPECT_EQ(late.output, "gpiochip0 line 10 (loop-back output)");
  // The median of what the emulated kernel adds: its bias and the median of its jitter, with half of the write.
  const auto& clock = descriptions.world->clock;
  const double expected_ns = 1e3 * (clock.bias_us + clock.jitter_us) + static_cast<double>(late.bracket_ns) / 2;
  EXPECT_NEAR(static_cast<double>(late.median_ns), expected_ns, 500);
  EXPECT_GT(late.p99_ns, late.median_ns + 2 * late.sigma_ns);
  EXPECT_GE(late.largest_ns, late.p99_ns);
  EXPECT_NE(host->ask<messages::LoopBack>().median_ns, late.median_ns) << "measured anew, 500 pulses";

  EXPECT_THAT(host->refusal<messages::LoopBack>({.pulses = 2001}).what,
              testing::AllOf(testing::HasSubstr("10 to"), testing::HasSubstr("2000")));
  EXPECT_EQ(host->refusal<messages::LoopBack>({.pulses = 9}).code, messages::ErrorCode::refused);
}

TEST_F(RunningDaemon, SaysWhyItCannotMeasureItsOwnPulses) {
  overrule("box.toml", "[loop_back]\noutput = { chip = \"gpiochip0\", line = 10 }\ninput = {", "# {");
  start();
  const auto none = connect()->refusal<messages::LoopBack>();
  EXPECT_EQ(none.code, messages::ErrorCode::not_found);
  EXPECT_THAT(none.what, testing::AllOf(testing::HasSubstr("[loop_back]"), testing::HasSubstr("box.toml")));
  daemon.reset();

  overrule("service.toml", "allow_calibrate = true", "allow_calibrate = false");
  start();
  EXPECT_EQ(connect()->refusal<messages::LoopBack>().code, messages::ErrorCode::not_permitted);
}

TEST_F(RunningDaemon, RefusesWithAReasonWhatServiceTomlDoesNotAllow) {
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = []\ncnc = []\n[access]\n[stream]\n";
  start();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto refused = host->refusal<messages::StartProcedure>({.method = "delay-multi-speed"});
  EXPECT_EQ(refused.code, messages::ErrorCode::not_permitted);
  EXPECT_THAT(refused.what, testing::HasSubstr("allow_calibrate"));
}

TEST_F(RunningDaemon, TakesNoNameThatIsNone) {
  start();
  const auto host = connect();
  for (const auto& by :
       {std::string{}, std::string{"  "}, std::string{"Ada\n9 active by Bob"}, std::string{"\x1b[2J"}}) {
    EXPECT_EQ(host->refusal<messages::AcceptResult>({.id = 1, .by = by}).code, messages::ErrorCode::malformed) << by;
    EXPECT_THAT(host->refusal<messages::RollbackResult>({.id = 0, .subject = "delay", .by = by}).what,
                testing::HasSubstr("person"));
  }
}

TEST_F(RunningDaemon, RefusesAMethodThatItDoesNotHaveAndNamesThoseItHas) {
  start();
  auto host = connect();
  const auto refused = host->refusal<messages::StartProcedure>({.method = "delay-by-guess"});
  EXPECT_EQ(refused.code, messages::ErrorCode::not_found);
  EXPECT_THAT(refused.what, testing::HasSubstr("delay-multi-speed"));
}

}  // namespace
}  // namespace probebox::app
