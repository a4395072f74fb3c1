#include <gmock/gmock.h>
#include <optional>

#include "box_on_lines.hpp"
#include "jumper.hpp"
#include "protocol/messages/self_test.hpp"

// The box pulses a real output, and the kernel stamps what comes back.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

class LoopBack : public BoxOnLines {
 protected:
  void SetUp() override { start(); }
  void join(Jumper::Faults faults = {}) { jumper.emplace(*chip, kLoopOut, kLoopIn, faults); }
  messages::LoopBack::Answer measure(std::uint32_t pulses) { return host->ask<messages::LoopBack>({.pulses = pulses}); }

  std::unique_ptr<GpioSim> chip{plugged()};
  std::optional<Jumper> jumper;
};

TEST_F(LoopBack, MeasuresHowLateItsKernelStampsEdges) {
  join();
  const auto late = measure(300);
  EXPECT_THAT(late.output, AllOf(HasSubstr("LOOP_OUT"), HasSubstr(kChip)));
  EXPECT_EQ(late.pulses, 300U);
  EXPECT_EQ(late.lost, 0U);
  EXPECT_EQ(jumper->passed(), 300U);
  EXPECT_GT(late.bracket_ns, 0);
  EXPECT_GT(late.median_ns, 0);
  EXPECT_LT(late.median_ns, 1'000'000) << "of the guest, of which nothing but the box and the jumper wants anything";
  EXPECT_GE(late.p99_ns, late.median_ns);
  EXPECT_GE(late.largest_ns, late.p99_ns);
}

TEST_F(LoopBack, TellsADelayOfTheWire) {
  join();
  const auto straight = measure(100);
  jumper.reset();
  join({.delay = 2ms, .one_lost_in = 0});
  const auto slow = measure(100);
  const auto held_ns = jumper->held().count();
  EXPECT_GE(held_ns, 2'000'000);
  EXPECT_GE(slow.median_ns, held_ns);
  EXPECT_LE(slow.median_ns, held_ns + straight.largest_ns) << "the rest of the way is what it was";
}

TEST_F(LoopBack, CountsThePulsesThatAreLost) {
  join({.delay = {}, .one_lost_in = 20});
  const auto late = measure(200);
  EXPECT_EQ(late.pulses, 200U);
  EXPECT_EQ(late.lost, 10U);
  EXPECT_EQ(jumper->lost(), 10U);
}

TEST_F(LoopBack, AsksForTheJumperThatIsNotThereAndForALineThatSomebodyHolds) {
  EXPECT_THAT(host->refusal<messages::LoopBack>({.pulses = 100}).what,
              AllOf(HasSubstr("never came back"), HasSubstr("jumper"), HasSubstr("LOOP_IN")));
  {
    const LineHolder holder{chip->chip(), kLoopIn, "spindle-monitor"};
    ASSERT_TRUE(holder.holds());
    EXPECT_THAT(host->refusal<messages::LoopBack>({.pulses = 100}).what,
                AllOf(HasSubstr("LOOP_IN"), HasSubstr("held by 'spindle-monitor'")));
  }
  join();
  EXPECT_EQ(measure(100).lost, 0U) << "nothing of it has stayed";
}

TEST_F(LoopBack, LosesNothingOfTheStreamMeanwhile) {
  host.reset();
  support::Balances balances;
  host = connect(&balances);
  ASSERT_TRUE(host);
  PulseTrain sync{*chip, kSync, kTick};
  ASSERT_TRUE(host->waitForLock()) << box.log();
  host->client().start({});
  ASSERT_TRUE(host->eventually([&] { return balances.samples >= 1000; }));
  join();
  const auto late = measure(200);
  EXPECT_LE(late.lost, 2U);
  const auto closing = host->finish();
  sync.stop();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(closing.account.received, closing.produced);
  EXPECT_EQ(line("sync").lost, 0U);
}

}  // namespace
}  // namespace probebox::vm
