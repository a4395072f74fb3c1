#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"

// The whole box with encoders behind the drivers that a real one has.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

// Scales of 0.1 um: a counter of 16 bits wraps every 6.6 mm, and half of that is beyond a millisecond of any move.
world::Config scales() {
  auto config = usualWorld();
  config.encoders.counts_per_mm = 10'000;
  return config;
}

class EncoderKind : public ::testing::TestWithParam<EncodersAre> {};

INSTANTIATE_TEST_SUITE_P(Every, EncoderKind,
                         ::testing::Values(EncodersAre::polled, EncodersAre::latched, EncodersAre::on_lines),
                         [](const auto& kind) {
                           return kind.param == EncodersAre::polled    ? "Polled"
                                  : kind.param == EncodersAre::latched ? "Latched"
                                                                       : "OnLines";
                         });

TEST_P(EncoderKind, GivesEverySampleAndThePositionsOfTheMachine) {
  Scenario scenario{scales(), 1, ProbeIs::stamped, GetParam()};
  scenario.run(10s);
  EXPECT_TRUE(scenario.recorded().contiguous);
  EXPECT_EQ(scenario.state().snapshot.events.disordered, 0U);
  EXPECT_EQ(scenario.state().snapshot.events.late, 0U);
  EXPECT_TRUE(scenario.state().snapshot.referenced);
  EXPECT_EQ(scenario.state().snapshot.events.incomplete_rows, 0U);
  const auto lost = scenario.state().snapshot.ledger.lost_at_source;
  scenario.run(5s);
  EXPECT_EQ(scenario.state().snapshot.ledger.lost_at_source, lost);
  EXPECT_GT(scenario.recorded().received, 28'000U);
}

// From edges, counts and deflections to a delay whose truth is known. A latched count is stamped late by a constant,
// which is a delay of the machine's data.
TEST_P(EncoderKind, CalibratesTheDelayToItsTruth) {
  Scenario scenario{scales(), 2, ProbeIs::stamped, GetParam()};
  scenario.recorder().keeps_bytes = false;
  scenario.run(5s);
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
  ASSERT_TRUE(solved->ok()) << solved->error().reason;
  const auto* tau = solved->value().find("tau_s");
  const double sd = tau->standardDeviation().value();
  const double late_s = GetParam() == EncodersAre::latched ? toSeconds(EmulatedEncoders::kStampLateness) : 0;
  EXPECT_LT(sd, 2e-5);
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0] + late_s, 5 * sd + 5e-6);
  EXPECT_EQ(scenario.state().lost.sources_gone, 0U);
}

TEST(Encoders, ACounterThatIsUnpluggedComesBackAndItsAxisAloneIsNotReferenced) {
  auto config = scales();
  config.encoders.power_up_mm = {1, 1, 1};  // they only count: every axis has to be referenced
  Scenario scenario{config, 3, ProbeIs::stamped, EncodersAre::polled};
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 20s));
  scenario.run(2s);
  ASSERT_TRUE(scenario.state().rates);
  EXPECT_NEAR(scenario.state().rates->positions_hz[1], 1000, 20);
  EXPECT_NEAR(scenario.state().rates->deflections_hz, 2000, 20);
  scenario.encoders().counter(1).unplug();
  scenario.run(500ms);
  EXPECT_FALSE(scenario.state().snapshot.referenced);
  EXPECT_EQ(scenario.state().lost.sources_gone, 1U);
  EXPECT_TRUE(scenario.state().snapshot.axes[0].referenced);
  EXPECT_FALSE(scenario.state().snapshot.axes[1].referenced);
  scenario.run(2s);
  EXPECT_EQ(scenario.state().rates->positions_hz[1], 0) << "over a whole window";
  EXPECT_NEAR(scenario.state().rates->positions_hz[2], 1000, 20);
  scenario.encoders().counter(1).plugIn(scenario.now());
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.encoders().source(1).problem().empty(); }, 3s));
  scenario.run(50ms);
  EXPECT_NEAR(scenario.state().rates->positions_hz[1], 1000, 20) << "at once";
  scenario.run(3s);
  EXPECT_EQ(scenario.encoders().source(1).problem(), "");
  const auto received = scenario.recorded().received;
  scenario.run(1s);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().received - received), 2000, 150);
}

TEST(Encoders, ACounterThatIsUnpluggedWhileTheQueueIsFullTakesTheReferenceWithIt) {
  auto config = scales();
  config.encoders.power_up_mm = {1, 1, 1};
  Scenario scenario{config, 5, ProbeIs::stamped, EncodersAre::polled};
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 20s));
  scenario.overflowQueue(1000);
  scenario.encoders().counter(1).unplug();
  scenario.run(1s);
  EXPECT_GT(scenario.state().lost.queue_events, 900U);
  EXPECT_EQ(scenario.state().lost.sources_gone, 1U);
  EXPECT_TRUE(scenario.state().snapshot.axes[0].referenced);
  EXPECT_FALSE(scenario.state().snapshot.axes[1].referenced);
}

// What the first jogs tell about the wiring.
TEST(Encoders, WithExchangedInputsAreFoundByTheSelftest) {
  for (const auto& [name, wire] :
       {std::pair<const char*, void (*)(EmulatedEncoders&)>{"sense-wrong", [](auto& e) { e.exchangeLines(0); }},
        {"axes-exchanged", [](auto& e) { e.exchangeAxes(0, 2); }}}) {
    Scenario scenario{scales(), 4, ProbeIs::stamped, EncodersAre::polled};
    wire(scenario.encoders());
    scenario.run(5s);
    const auto solved = scenario.calibrate(procedure::kSelftest);
    ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
    ASSERT_FALSE(solved->ok());
    EXPECT_EQ(solved->error().name, name) << solved->error().reason;
  }
  Scenario scenario{scales(), 4, ProbeIs::stamped, EncodersAre::polled};
  scenario.run(5s);
  const auto solved = scenario.calibrate(procedure::kSelftest);
  ASSERT_TRUE(solved);
  EXPECT_TRUE(solved->ok()) << solved->error().reason;
}

}  // namespace
}  // namespace probebox::scenario
