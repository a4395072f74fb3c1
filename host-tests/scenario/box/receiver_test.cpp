#include <array>
#include <cmath>
#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "protocol/messages/fields.hpp"
#include "watched_twin.hpp"

// The whole box with a probe receiver that counts its samples on an oscillator of its own.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

std::uint64_t lostToProbe(const Scenario& scenario) {
  return scenario.state().snapshot.ledger.lost_at_source;
}

TEST(Receiver, LosesOnlyWhatCameBeforeItsClockWasGoodEnough) {
  Scenario scenario{usualWorld(), 1, ProbeIs::counted};
  EXPECT_TRUE(scenario.runUntil([&] { return scenario.state().probe_clock.state == ClockState::locked; }, 5s));
  scenario.run(1s);
  const auto lost_at_lock = lostToProbe(scenario);
  const auto unstamped_at_lock = scenario.state().probe_clock.counters.unstamped;
  EXPECT_GT(unstamped_at_lock, 100U);
  scenario.run(20s);
  EXPECT_EQ(lostToProbe(scenario), lost_at_lock);
  const auto& probe = scenario.state().probe_clock;
  EXPECT_EQ(probe.counters.unstamped, unstamped_at_lock);
  EXPECT_EQ(probe.counters.samples, probe.counters.stamped + probe.counters.unstamped);
  EXPECT_NEAR(probe.offset_ppm, 60, 1);
  const auto& clock = scenario.state().snapshot.clock;
  EXPECT_EQ(clock.absolute_sigma_ns, clock.sigma_ns) << "the kernel stamps its ticks";
  EXPECT_TRUE(scenario.recorded().contiguous);
  EXPECT_EQ(scenario.recorded().lost_samples, lostToProbe(scenario));
  EXPECT_EQ(scenario.state().snapshot.events.disordered, 0U);
  EXPECT_EQ(scenario.state().snapshot.events.late, 0U);
  EXPECT_EQ(scenario.state().lost.deflections, 0U);
}

TEST(Receiver, CountsExactlyWhatTheReceiverLeftOut) {
  Scenario scenario{usualWorld(), 2, ProbeIs::counted};
  scenario.run(5s);
  const auto lost = lostToProbe(scenario);
  scenario.inject(world::FaultKind::probe_silent, 0s, 200ms);
  scenario.run(5s);
  EXPECT_EQ(scenario.state().lost.deflections, scenario.truth().ledger.dropped_probe);
  EXPECT_GT(scenario.state().lost.deflections, 390U);
  EXPECT_NEAR(static_cast<double>(lostToProbe(scenario) - lost), 400, 10);
  EXPECT_TRUE(scenario.recorded().contiguous);
  EXPECT_EQ(scenario.state().probe_clock.state, ClockState::locked);
  EXPECT_EQ(scenario.state().probe_clock.counters.relocks, 0U);
}

TEST(Receiver, ComesBackAsANewEpochAfterItWasUnplugged) {
  Scenario scenario{usualWorld(), 3, ProbeIs::counted};
  scenario.run(5s);
  scenario.receiver().unplug();
  scenario.push(SourceLost{Source::probe, LossReason::disconnected, 0, scenario.now()});
  scenario.run(100ms);
  EXPECT_EQ(scenario.state().probe_clock.state, ClockState::unlocked);
  EXPECT_EQ(scenario.state().lost.sources_gone, 1U);
  scenario.run(2s);
  scenario.receiver().plugIn(7000);  // it counts from elsewhere now
  scenario.run(5s);
  const auto& probe = scenario.state().probe_clock;
  EXPECT_EQ(probe.state, ClockState::locked);
  EXPECT_EQ(probe.counters.relocks, 1U);
  EXPECT_EQ(probe.counters.missing, 0U) << "what was sent while nobody listened is unknown";
  EXPECT_NEAR(static_cast<double>(probe.counters.samples), static_cast<double>(scenario.receiver().sent()), 16);
  EXPECT_TRUE(scenario.recorded().contiguous);
  EXPECT_EQ(scenario.recorded().lost_samples, lostToProbe(scenario));
  const auto received = scenario.recorded().received;
  scenario.run(1s);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().received - received), 2000, 150);
}

TEST(Receiver, AReplayedJournalGivesTheSameBytes) {
  Scenario scenario{usualWorld(), 4, ProbeIs::counted};
  scenario.keepEvents(true);
  scenario.run(5s);
  std::vector<Event> journal;
  std::array<std::byte, 256> buffer;
  std::size_t counted = 0;
  for (const auto& event : scenario.events()) {
    const auto size = messages::encode(event, buffer);
    ASSERT_TRUE(size);
    const auto decoded = messages::decode<Event>(std::span{buffer}.first(*size));
    ASSERT_TRUE(decoded);
    journal.push_back(*decoded);
    if (std::holds_alternative<CountedDeflection>(*decoded)) ++counted;
  }
  EXPECT_GT(counted, 9000U);
  EXPECT_EQ(replay(journal).bytes, scenario.recorded().bytes);
  // One arrival less that tells about the time, and every stamp after it is another one.
  const auto one = std::find_if(journal.begin(), journal.end(), [](const Event& event) {
    const auto* const sample = std::get_if<CountedDeflection>(&event);
    return sample != nullptr && sample->newest;
  });
  std::get<CountedDeflection>(*one).newest = false;
  EXPECT_NE(replay(journal).bytes, scenario.recorded().bytes);
}

// The constant part of the arrivals' delay cannot be told from a delay of the probe: the calibration finds their
// difference to the machine's, as it should.
TEST(Receiver, CalibrationAbsorbsTheConstantDelayOfTheWay) {
  Scenario scenario{usualWorld(), 5, ProbeIs::counted};
  scenario.recorder().keeps_bytes = false;
  scenario.run(65s);  // until the jitter has been learned
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
  ASSERT_TRUE(solved->ok()) << solved->error().reason;
  const auto* tau = solved->value().find("tau_s");
  const double sd = tau->standardDeviation().value();
  EXPECT_LT(sd, 2e-5);
  const double way_s = CountedProbe::kMedianNs * 1e-9;
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0] - way_s, 5 * sd + 2e-5);
}

// With the encoders on the receiver there is no way between the two: the same calibration finds the machine's own
// delay, whatever the way of the packets is.
TEST(Receiver, WithTheEncodersHasADelayFixedByConstruction) {
  Scenario scenario{usualWorld(), 5, ProbeIs::counted_with_axes};
  scenario.recorder().keeps_bytes = false;
  scenario.run(5s);  // nothing has to be learned
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
  ASSERT_TRUE(solved->ok()) << solved->error().reason;
  const auto* tau = solved->value().find("tau_s");
  const double sd = tau->standardDeviation().value();
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0], 4 * sd);
  EXPECT_GT(CountedProbe::kMedianNs * 1e-9, 6 * sd) << "the way of the packets would show";
}

// Machine, probe and lines behind the front end, whose stamps know nothing of the kernel's.
world::Config frontEndWorld() {
  auto world = usualWorld();
  world.probe.rate_hz = FrontEndProbe::kRate_hz;
  world.encoders.counts_per_mm = 10'000;   // 2 million counts a second at 200 mm/s
  world.encoders.power_up_mm = {1, 2, 3};  // incremental: axes pass their marks
  world.clock.bias_us = world.clock.jitter_us = world.clock.outlier_probability = 0;
  return world;
}

// The packets are those of the program that is flashed, compiled for this computer (system.front_end compares the two).
TEST(FrontEnd, CarriesARunFromItsPinsToADelayThatIsAccepted) {
  Scenario scenario{frontEndWorld(), 12, ProbeIs::front_end};
  scenario.recorder().keeps_bytes = false;
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 60s)) << "by its index latches";
  for (const auto* const method : {&procedure::kDelayMultiSpeed, &procedure::kDelayKnownSphere}) {
    const auto solved = scenario.calibrate(*method);
    ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    const auto* tau = solved->value().find("tau_s");
    const double sd = tau->standardDeviation().value();
    EXPECT_LT(sd, 1e-4);
    EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0], 4 * sd);
    EXPECT_GT(CountedProbe::kMedianNs * 1e-9, 4 * sd) << "the way of the packets would show";
    scenario.activateDelay({tau->value(), tau->value(), tau->value()});
    EXPECT_EQ(scenario.state().snapshot.delay.result_id, 99U);
  }
  const auto& counters = scenario.frontEnd().counters();
  EXPECT_EQ(counters.edges_lost + counters.latches_lost + counters.samples_dropped, 0U);
  for (const auto& axis : scenario.state().snapshot.axes) EXPECT_EQ(axis.reference_losses, 0U);
  const auto& clock = scenario.state().snapshot.clock;
  EXPECT_GT(clock.absolute_sigma_ns, clock.sigma_ns) << "a tick is surer among the samples than on the computer's time";
  EXPECT_GE(clock.absolute_sigma_ns, scenario.state().snapshot.receiver.sigma_ns);
  scenario.push(SourceLost{Source::probe, LossReason::disconnected, 0, scenario.now()});
  scenario.run(20ms);
  ASSERT_EQ(scenario.state().snapshot.receiver.state, ClockState::unlocked);
  EXPECT_EQ(scenario.state().snapshot.clock.absolute_sigma_ns, 4'000'000'000U) << "packets are all that tells it";
}

// Y is on a second front end, whose oscillator is its own: one delay fits all three axes.
TEST(FrontEnd, CarriesARunTogetherWithASecondOne) {
  Scenario scenario{frontEndWorld(), 12, ProbeIs::two_front_ends};
  scenario.recorder().keeps_bytes = false;
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 60s)) << "by its index latches";
  const auto solved = scenario.calibrate(procedure::kDelayMultiSpeed);
  ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
  ASSERT_TRUE(solved->ok()) << solved->error().reason;
  const auto* tau = solved->value().find("tau_s");
  const double sd = tau->standardDeviation().value();
  EXPECT_LT(sd, 1e-4);
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0], 4 * sd);
  scenario.activateDelay({tau->value(), tau->value(), tau->value()});
  EXPECT_EQ(scenario.state().snapshot.delay.result_id, 99U);
  const auto& second = scenario.state().snapshot.second_receiver;
  EXPECT_EQ(second.state, ClockState::locked);
  EXPECT_LT(second.sigma_ns, 100U);
  EXPECT_EQ(second.missing + second.restarts + second.unmatched, 0U);
  EXPECT_NEAR(second.frequency_ppb, 37'000, 40'000) << "beside the first, which is off by itself";
}

// Whatever becomes of the second, samples of the probe keep their times, and what was lost is told by name.
TEST(FrontEnd, GoesOnWithoutTheSecondOne) {
  Scenario scenario{frontEndWorld(), 13, ProbeIs::two_front_ends};
  scenario.run(10s);
  const auto& snapshot = scenario.state().snapshot;
  ASSERT_EQ(snapshot.second_receiver.state, ClockState::locked);
  scenario.second_misses_sync = true;
  scenario.run(600ms);
  EXPECT_EQ(snapshot.second_receiver.state, ClockState::holdover);
  scenario.second_misses_sync = false;
  scenario.run(2s);
  EXPECT_EQ(snapshot.second_receiver.state, ClockState::locked);
  EXPECT_GT(snapshot.second_receiver.unseen, 500U);
  EXPECT_EQ(snapshot.second_receiver.restarts, 0U);
  scenario.secondFrontEnd().restart();
  scenario.run(5s);
  EXPECT_EQ(snapshot.second_receiver.state, ClockState::locked);
  EXPECT_EQ(snapshot.second_receiver.restarts, 1U);
  const auto unstamped = snapshot.receiver.unstamped, samples = snapshot.receiver.samples;
  const auto lost = snapshot.ledger.lost_at_source;
  scenario.secondFrontEnd().setUnplugged(true);
  scenario.push(SourceLost{Source::encoders, LossReason::disconnected, 0, scenario.now(), axisBit(Axis::y)});
  scenario.run(1s);
  EXPECT_EQ(snapshot.second_receiver.state, ClockState::unlocked);
  EXPECT_EQ(snapshot.receiver.state, ClockState::locked);
  EXPECT_EQ(snapshot.receiver.unstamped, unstamped);
  EXPECT_NEAR(static_cast<double>(snapshot.receiver.samples - samples), 1999, 30);
  EXPECT_GT(snapshot.ledger.lost_at_source, lost) << "samples without Y are declared, as without any encoder";
  scenario.secondFrontEnd().setUnplugged(false);
  scenario.run(5s);
  EXPECT_EQ(snapshot.second_receiver.state, ClockState::locked);
}

TEST(Receiver, UnpluggedWithTheEncodersTakesTheirReferenceAway) {
  auto world = usualWorld();
  world.encoders.power_up_mm = {1, 2, 3};  // the axes have to be referenced
  Scenario scenario{world, 8, ProbeIs::counted_with_axes};
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 30s));
  scenario.receiver().unplug();
  scenario.push(SourceLost{Source::probe, LossReason::disconnected, 0, scenario.now()});
  scenario.push(SourceLost{Source::encoders, LossReason::disconnected, 0, scenario.now()});
  scenario.run(1s);
  EXPECT_FALSE(scenario.state().snapshot.referenced) << "nothing counts";
  scenario.receiver().plugIn(100);
  scenario.run(5s);
  EXPECT_EQ(scenario.state().probe_clock.state, ClockState::locked);
  EXPECT_TRUE(scenario.recorded().contiguous);
}

// An absolute encoder that cannot be read goes on being sent with its last good count.
TEST(Receiver, WithAnEncoderThatCannotBeReadHoldsWhatItServes) {
  auto world = warmingWorld();
  world.encoders.power_up_mm = {};
  Scenario scenario{world, 9, ProbeIs::counted_with_axes};
  const auto& served = scenario.state().snapshot;
  ASSERT_TRUE(scenario.runUntil([&] { return served.valid; }, 20s));
  const auto lost = scenario.state().lost.counts;
  scenario.receiver().setFaults(0b001);
  scenario.run(1s);
  EXPECT_TRUE(served.degraded);
  EXPECT_EQ(served.health[0], published::Health::held);
  EXPECT_NEAR(static_cast<double>(scenario.state().lost.counts - lost), 2000, 20) << "a reading a sample";
  scenario.run(30s);
  EXPECT_FALSE(served.valid);
  scenario.receiver().setFaults(0);
  scenario.run(20s);
  EXPECT_TRUE(served.valid);
  EXPECT_FALSE(served.degraded);
}

// Indexes of axes in motion, latched as a receiver does that does not measure when: the counts are up to a sample's way
// farther than those of the sample whose time they have.
TEST(Receiver, AnIndexIsNoSampleOfItsAxis) {
  Scenario scenario{usualWorld(), 10, ProbeIs::counted_with_axes};
  scenario.describeBy([](box::BoxConfig& box) {
    for (auto& reference : box.corrections.references) reference.has_mark = false;
  });
  scenario.restartBox();
  scenario.run(5s);
  scenario.start(procedure::kDelayMultiSpeed);
  const auto& procedure = scenario.state().procedure;
  const auto& served = scenario.state().snapshot;
  const auto truth = scenario.truth();
  std::uint32_t triggers = 0;
  for (int ms = 0; ms < 200'000 && triggers < 10; ++ms) {
    scenario.run(1ms);
    const auto counts = scenario.countsAt(scenario.now());
    for (std::uint8_t axis = 0; axis < kLinearAxes; ++axis) scenario.receiver().latch(axis, counts[axis]);
    if (served.last_trigger.number == triggers) continue;
    triggers = served.last_trigger.number;
    double distance_mm = 0;
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      distance_mm = std::hypot(distance_mm, served.last_trigger.position_mm[axis] - truth.sphere_centre_mm[axis]);
    EXPECT_NEAR(distance_mm, truth.effective_radius_mm, 1) << "but for the delay";
  }
  EXPECT_EQ(triggers, 10U) << "stopped in step " << procedure.step;
  for (const auto& axis : served.axes) EXPECT_EQ(axis.reference_losses, 0U);
}

TEST(Receiver, ATouchDuringWhichTheReceiverWasGoneIsAskedForAgain) {
  Scenario scenario{usualWorld(), 6, ProbeIs::counted};
  scenario.recorder().keeps_bytes = false;
  scenario.run(5s);
  scenario.push(ProcedureStarted{.run = 1, .method = procedure::kDelayMultiSpeed.number, .at = scenario.now()});
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::running; }, 30s));
  const auto step = scenario.state().procedure.step;
  scenario.receiver().unplug();
  scenario.receiver().plugIn(5000);  // faster than anybody could say so: only the counter tells
  scenario.run(20ms);
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.repeats == 1; }, 30s));
  EXPECT_EQ(scenario.state().procedure.step, step);
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::source_lost);
}

TEST(Receiver, TakesNoMemoryOnTheTickPath) {
  Scenario scenario{usualWorld(), 7, ProbeIs::counted};
  scenario.recorder().keeps_bytes = false;
  WatchedTwin twin{scenario, usualWorld()};
  scenario.run(5s);
  EXPECT_EQ(twin.allocations, 0U);
  EXPECT_GT(twin.outputs.received, 5000U);
}

}  // namespace
}  // namespace probebox::scenario
