#include "host-tests/emulation/hosts.hpp"

#include <gtest/gtest.h>
#include <map>

#include "firmware/procedure/methods/methods.hpp"

// Hosts that stall, vanish and come back, with sources that fail meanwhile: every sample has one fate at every host,
// and none costs another anything.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using messages::GapReason;
using messages::Policy;
using messages::Profile;
using world::FaultKind;

// Of all that there was, each sample is received or declared lost, and the host has what the box has given.
void expectExact(Office& office, const VirtualHost& host) {
  EXPECT_EQ(host.received() + host.declaredLost(), host.total());
  EXPECT_EQ(host.faults(), 0U);
  EXPECT_GT(host.heartbeats(), 10U);
  EXPECT_EQ(host.next(), *office.scenario().recorded().next) << "nothing waits any more";
}

void expectComplete(Office& office, const VirtualHost& host) {
  expectExact(office, host);
  EXPECT_EQ(host.declaredLost(), 0U);
}

TEST(Hosts, OfEveryPolicyAndProfileGetEverySample) {
  Office office;
  const std::array<VirtualHost*, 4> hosts{
      &office.add({Policy::record, Profile::raw}), &office.add({Policy::record, Profile::fast}),
      &office.add({Policy::live, Profile::raw}), &office.add({Policy::live, Profile::fast})};
  office.run(6s);
  for (const auto* host : hosts) expectComplete(office, *host);
}

TEST(Hosts, ThatStopReadingLoseTheOldestUnderPolicyLive) {
  Office office;
  auto& stalled = office.add({Policy::live, Profile::raw});
  auto& other = office.add();
  office.run(3s);
  stalled.stopReading();
  office.run(6s);
  const auto before = stalled.next();
  stalled.stopReading(false);
  office.run(2s);
  expectExact(office, stalled);
  expectComplete(office, other);
  EXPECT_GT(stalled.declaredLost(GapReason::queue_full), 2 * 3000U);
  EXPECT_GT(stalled.received(), 2 * 5000U) << "the newest were kept";
  EXPECT_GT(stalled.next(), before);
}

TEST(Hosts, ThatStopReadingKeepTheOldestUnderPolicyRecord) {
  Office office;
  auto& stalled = office.add({Policy::record, Profile::raw});
  auto& short_stall = office.add({Policy::record, Profile::fast});
  office.run(3s);
  stalled.stopReading();
  short_stall.stopReading();
  office.run(4s);
  short_stall.stopReading(false);
  office.run(16s);
  stalled.stopReading(false);
  office.run(3s);
  expectExact(office, stalled);
  expectComplete(office, short_stall);
  EXPECT_GT(stalled.declaredLost(GapReason::queue_full), 2 * 3000U);
}

TEST(Hosts, ThatStallAtTheSameTimeEachHaveTheirOwnAccount) {
  Office office;
  auto& live = office.add({Policy::live, Profile::raw});
  auto& record = office.add({Policy::record, Profile::raw});
  auto& live_fast = office.add({Policy::live, Profile::fast});
  auto& steady = office.add({Policy::record, Profile::fast});
  office.scenario().inject(FaultKind::probe_silent, 5s, 400ms);
  office.scenario().inject(FaultKind::encoders_silent, 9s, 200ms);
  office.run(3s);
  for (auto* host : {&live, &record, &live_fast}) host->stopReading();
  office.run(15s);
  for (auto* host : {&live, &record, &live_fast}) host->stopReading(false);
  office.run(3s);
  for (const auto* host : {&live, &record, &live_fast, &steady}) expectExact(office, *host);
  EXPECT_EQ(steady.declaredLost(GapReason::queue_full), 0U);
  EXPECT_EQ(steady.declaredLost(), office.scenario().recorded().lost_samples);
  for (const auto* host : {&live, &record, &live_fast}) EXPECT_GT(host->declaredLost(GapReason::queue_full), 2 * 3000U);
  EXPECT_EQ(record.declaredLost(GapReason::source_probe), steady.declaredLost(GapReason::source_probe))
      << "the oldest were kept, with what was missing among them";
}

TEST(Hosts, ThatVanishInMidFrameResumeWithoutAHole) {
  Office office;
  auto& raw = office.add({Policy::record, Profile::raw});
  auto& fast = office.add({Policy::live, Profile::fast});
  for (int round = 0; round < 8; ++round) {
    office.run(1500ms);
    for (auto* host : {&raw, &fast}) host->cutAfter(static_cast<std::size_t>(137 * round + 5));
    office.run(700ms);
    for (auto* host : {&raw, &fast}) {
      ASSERT_FALSE(host->connected());
      office.connect(*host);
    }
  }
  office.run(2s);
  for (const auto* host : {&raw, &fast}) {
    expectComplete(office, *host);
    EXPECT_EQ(host->connections(), 9U);
  }
}

TEST(Hosts, ThatWereAwayForTooLongAreToldWhatTheyMissed) {
  Office office{100'000};  // a second of raw samples
  auto& raw = office.add({Policy::record, Profile::raw});
  office.run(3s);
  raw.cutAfter(1000);
  office.run(10s);
  office.scenario().inject(FaultKind::probe_silent, 0s, 100ms);
  office.connect(raw);
  office.run(3s);
  expectExact(office, raw);
  EXPECT_GT(raw.declaredLost(GapReason::resume_too_old), 2 * 8000U);
  EXPECT_EQ(raw.declaredLost(GapReason::source_probe), office.scenario().recorded().lost_samples);
}

// Faults of the sources, each with a host that stalls: what the box lost, what the queue lost, and what came make all.
class WithAFault : public testing::TestWithParam<std::pair<FaultKind, Nanoseconds>> {};

TEST_P(WithAFault, EveryHostBalances) {
  Office office;
  auto& stalled = office.add({Policy::live, Profile::raw});
  auto& steady = office.add({Policy::record, Profile::fast});
  office.scenario().inject(GetParam().first, 4s, GetParam().second, 400us);
  office.run(3500ms);
  stalled.stopReading();
  office.run(4s);
  stalled.stopReading(false);
  steady.cutAfter(300);
  office.run(1s);
  office.connect(steady);
  office.run(6s);
  expectExact(office, stalled);
  expectExact(office, steady);
  EXPECT_EQ(steady.declaredLost(), office.scenario().recorded().lost_samples);
  EXPECT_TRUE(office.scenario().recorded().contiguous);
}

INSTANTIATE_TEST_SUITE_P(
    Sources, WithAFault,
    testing::Values(std::pair{FaultKind::probe_silent, 500ms}, std::pair{FaultKind::probe_frozen, 500ms},
                    std::pair{FaultKind::probe_noisy, 500ms}, std::pair{FaultKind::encoders_silent, 500ms},
                    std::pair{FaultKind::encoders_stuck, 500ms}, std::pair{FaultKind::sync_silent, 2000ms},
                    std::pair{FaultKind::edges_lost, 500ms}, std::pair{FaultKind::edges_doubled, 500ms},
                    std::pair{FaultKind::clock_jumps, 1000ms}));

// What every host hears of triggers is what the registers say, and it hears of each once, however its link fares.
TEST(Hosts, HearOfEveryTriggerWhereTheMachineWasAndWhatWasServed) {
  Office office{2U << 20U, stream::TriggerHistory::kKept, warmingWorld()};
  std::map<std::uint16_t, std::array<double, 3>> served;
  office.scenario().around = [&](const Event&) {
    const auto& snapshot = office.scenario().state().snapshot;
    served[snapshot.sequence] = snapshot.correction_mm;
  };
  auto& steady = office.add();
  auto& shaky = office.add({Policy::live, Profile::raw});
  office.run(2s);
  office.scenario().start(procedure::kDelayMultiSpeed);
  for (int round = 0; round < 10; ++round) {
    office.run(4s);
    shaky.cutAfter(static_cast<std::size_t>(61 * round));
    office.run(2s);
    office.connect(shaky);
  }
  office.run(2s);
  const auto& all = office.scenario().recorded().triggers;
  ASSERT_GT(all.size(), 20U);
  const auto& last = office.scenario().state().snapshot.last_trigger;
  EXPECT_EQ(all.back().stamp.number, last.number);
  EXPECT_EQ(all.back().stamp.position_mm, last.position_mm);
  for (const auto* host : {&steady, &shaky}) {
    EXPECT_EQ(host->faults(), 0U);
    EXPECT_EQ(host->lostTriggers(), 0U);
    ASSERT_EQ(host->triggers().size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto& heard = host->triggers()[k];
      EXPECT_EQ(heard.number, k + 1);
      EXPECT_EQ(heard.at, all[k].stamp.at);
      EXPECT_EQ(heard.has_position, 7U);
      EXPECT_EQ(heard.position_mm, all[k].stamp.position_mm);
      EXPECT_TRUE(heard.correction_valid);
      EXPECT_NE(heard.correction_mm[0], 0) << "the screws are warming up";
      ASSERT_TRUE(served.contains(heard.sequence));
      EXPECT_EQ(heard.correction_mm, served.at(heard.sequence));
    }
    EXPECT_GT(host->triggers().back().sequence, host->triggers().front().sequence);
  }
}

TEST(Hosts, ThatStopReadingAreToldWhichTriggersTheyLost) {
  Office office{2U << 20U, 8};
  auto& stalled = office.add({Policy::live, Profile::raw});
  auto& other = office.add();
  office.run(2s);
  office.scenario().start(procedure::kDelayMultiSpeed);
  office.run(4s);
  stalled.stopReading();
  office.run(40s);
  stalled.stopReading(false);
  office.run(2s);
  const auto& all = office.scenario().recorded().triggers;
  EXPECT_GT(stalled.lostTriggers(), 0U);
  EXPECT_EQ(stalled.triggers().size() + stalled.lostTriggers(), all.size());
  for (const auto& heard : stalled.triggers()) {
    EXPECT_EQ(heard.at, all.at(heard.number - 1).stamp.at);
    EXPECT_EQ(heard.position_mm, all.at(heard.number - 1).stamp.position_mm);
  }
  EXPECT_EQ(stalled.triggers().back().number, all.back().stamp.number);
  EXPECT_EQ(other.triggers().size(), all.size()) << "it cost nobody else anything";
  expectExact(office, stalled);
  expectComplete(office, other);
}

// The tick and its phase are the stamp, on the master clock.
TEST(Hosts, HearWhenOnTheMasterClockATriggerWas) {
  Office office;
  auto& host = office.add();
  office.run(2s);
  office.scenario().start(procedure::kDelayMultiSpeed);
  office.run(20s);
  ASSERT_GT(host.triggers().size(), 4U);
  const auto& map = office.scenario().state().map;
  for (const auto& trigger : host.triggers()) {
    EXPECT_EQ(trigger.clock_state, ClockState::locked);
    const double ticks =
        static_cast<double>(trigger.tick.index - map.tick.index) + static_cast<double>(trigger.phase_q32) * 0x1p-32;
    const double at_ns = static_cast<double>(toNs(map.at)) + ticks * static_cast<double>(map.period_q32_ns) * 0x1p-32;
    EXPECT_NEAR(at_ns, static_cast<double>(toNs(trigger.at)), 20'000) << "the clock has wandered a little since";
  }
}

TEST(Hosts, BeginAnewAfterTheBoxWasRestartedInMidCalibration) {
  Office office;
  auto& host = office.add();
  office.run(2s);
  const auto run = office.scenario().start(procedure::kDelayMultiSpeed);
  office.run(4s);
  EXPECT_EQ(office.scenario().state().procedure.run, run);
  expectExact(office, host);
  office.restartBox();
  EXPECT_EQ(office.scenario().state().procedure.run, 0U) << "the new box knows of no run";
  auto& after = office.add();
  office.run(4s);
  expectComplete(office, after);
  EXPECT_EQ(office.scenario().state().snapshot.calibration, published::CalibrationState::idle);
}

}  // namespace
}  // namespace probebox::scenario
