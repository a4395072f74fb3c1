#include "drivers/counter/counter_source.hpp"

#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/counter/emulator.hpp"
#include "host-tests/support/events_of.hpp"

// What is made of a counter device's counts: unwrapped, stamped, counted where they are missing.
namespace probebox::counter {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class CounterSourceTest : public ::testing::Test {
 protected:
  void open(EmulatedCounter::Config emulated, CounterConfig config = {}) {
    config.device = "counter0";
    if (config.interval == Nanoseconds{}) config.interval = 1ms;
    emulated.interval = config.is_latched ? Nanoseconds{} : config.interval;
    auto port = std::make_unique<EmulatedCounter>(emulated, [this](MonoTime at) {
      return std::llround(counts_a_second * 1e-9 * static_cast<double>((at - begin).count()));
    });
    device = port.get();
    source = std::make_unique<CounterSource>(std::move(port), config);
    is_latched = config.is_latched;
    read();
  }
  void run(Nanoseconds duration) {
    for (const MonoTime end = now + duration; now < end;) {
      now += 1ms;
      if (is_latched && latches) device->latch(now - 40us, now - 30us);
      read();
    }
  }
  void read() {
    std::array<Event, 5> batch;
    while (const std::size_t count = source->read(batch, now))
      events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(count));
  }
  template <class T>
  std::vector<T> all() const {
    return support::eventsOf<T>(events);
  }
  double truth(MonoTime at) const { return counts_a_second * 1e-9 * static_cast<double>((at - begin).count()); }

  const MonoTime begin{monoTime(7'000'000'000)};
  MonoTime now{begin};
  double counts_a_second{};
  bool is_latched{}, latches{true};
  EmulatedCounter* device{};
  std::unique_ptr<CounterSource> source;
  std::vector<Event> events;
};

// Up and down over many turns of a counter of 16 and of 32 bits, and of one with a ceiling of its own.
TEST_F(CounterSourceTest, UnwrapsCountsOfAnyWidth) {
  struct Width {
    std::uint64_t ceiling, power_up;
    std::uint8_t bits;
  };
  for (const auto& [ceiling, power_up, bits] :
       {Width{0xFFFF, 65'000, 16}, Width{0xFFFF'FFFF, 4'294'967'000, 32}, Width{9999, 9990, 0},
        Width{std::numeric_limits<std::uint64_t>::max(), 0, 0}}) {
    for (const double speed : {3e6, -3e6}) {
      events.clear();
      now = begin;
      counts_a_second = speed;
      open({.ceiling = ceiling, .power_up = power_up}, {.bits = bits});
      run(300ms);
      const auto counts = all<Count>();
      ASSERT_GT(counts.size(), 290U);
      for (const auto& count : counts)
        EXPECT_NEAR(static_cast<double>(count.counts - counts[0].counts), truth(count.at) - truth(counts[0].at), 1.01)
            << ceiling;
      EXPECT_TRUE(all<SourceLost>().empty());
    }
  }
}

// The stamp is the middle of the read, and the count is taken anywhere in it.
TEST_F(CounterSourceTest, StatesAnHonestSdOfItsStamps) {
  counts_a_second = 1e9;  // a count a nanosecond
  std::mt19937 random{3};
  double sum = 0;
  int reads = 0;
  for (int i = 0; i < 400; ++i) {
    events.clear();
    now = begin;
    open({.ceiling = ~std::uint64_t{0}, .read_takes = 20us, .read_at = std::uniform_real_distribution{}(random)}, {});
    run(2ms);
    for (const auto& count : all<Count>()) {
      const double off_ns = static_cast<double>(count.counts) - truth(count.at);
      sum += off_ns * off_ns;
      ++reads;
    }
  }
  const double seen_ns = std::sqrt(sum / reads);
  run(3s);
  EXPECT_NEAR(static_cast<double>(source->stampSd().count()), 20'000 / std::sqrt(12), 300);
  EXPECT_NEAR(seen_ns, 20'000 / std::sqrt(12), 500);
}

TEST_F(CounterSourceTest, ReadsAgainWhatTookTooLongAndLeavesAGapAtLast) {
  counts_a_second = 1e5;
  open({}, {});
  run(20ms);
  device->slowReads(2, 150us);
  run(10ms);
  EXPECT_EQ(source->unusable(), 0U);
  device->slowReads(3, 300us);
  run(10ms);
  EXPECT_EQ(source->unusable(), 1U);
  const auto counts = all<Count>();
  EXPECT_EQ(counts.back().sequence, counts.size()) << "one is missing, and the sequence tells";
  for (const auto& count : counts) EXPECT_NEAR(static_cast<double>(count.counts), truth(count.at), 1.01);
}

TEST_F(CounterSourceTest, TakesTheKernelsStampOfALatchedCount) {
  counts_a_second = 1e6;
  open({.ceiling = 0xFFFF}, {.bits = 16, .is_latched = true});
  run(200ms);
  const auto counts = all<Count>();
  ASSERT_EQ(counts.size(), 200U);
  for (std::size_t i = 1; i < counts.size(); ++i) {
    EXPECT_EQ(counts[i].counts - counts[i - 1].counts, 1000);
    EXPECT_EQ(counts[i].at - counts[i - 1].at, 1ms);
    EXPECT_EQ(counts[i].sequence, i);
  }
  EXPECT_EQ(toNs(counts[0].at), toNs(begin + 1ms - 30us));
  EXPECT_EQ(source->stampSd().count(), 0);
}

// The kernel's queue is full without a word: the period tells how many latches are missing.
TEST_F(CounterSourceTest, CountsTheLatchesThatTheKernelDropped) {
  counts_a_second = 1e6;
  open({.queue_events = 32}, {.is_latched = true});
  run(10ms);
  for (int i = 0; i < 50; ++i) {
    now += 1ms;
    device->latch(now - 40us, now - 30us);
  }
  read();
  run(10ms);
  ASSERT_EQ(device->dropped(), 18U);
  const auto counts = all<Count>();
  EXPECT_EQ(counts.back().sequence, counts.size() - 1 + 18);
  EXPECT_TRUE(all<SourceLost>().empty()) << "the counts that came are right";
}

TEST_F(CounterSourceTest, LeavesOutALatchThatComesTwice) {
  open({}, {.is_latched = true});
  run(5ms);
  device->latch(now, now - 25us);
  run(5ms);
  EXPECT_EQ(source->unusable(), 1U);
  EXPECT_EQ(all<Count>().back().sequence, all<Count>().size() - 1);
}

TEST_F(CounterSourceTest, SaysThatNothingLatches) {
  latches = false;
  open({}, {.is_latched = true});
  run(900ms);
  EXPECT_EQ(source->problem(), "");
  run(200ms);
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("sync line"));
  latches = true;
  run(5ms);
  EXPECT_EQ(source->problem(), "");
}

// Stamps never go back, wherever the index falls between two reads.
TEST_F(CounterSourceTest, GivesIndexPulsesInTheOrderOfTheirStamps) {
  counts_a_second = 1e5;
  open({}, {});
  run(5ms);
  device->indexPulse(now + 1ms - 200us);  // before the next read
  run(1ms);
  device->indexPulse(now + 1ms + 6us);  // while it is read
  run(2ms);
  const auto edges = all<Edge>();
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges[0].role, LineRole::index);
  EXPECT_EQ(edges[0].line, 0);
  EXPECT_EQ(edges[0].line_sequence, 1U);
  EXPECT_EQ(edges[1].line_sequence, 2U);
  for (std::size_t i = 1; i < events.size(); ++i) EXPECT_GE(stampOf(events[i]), stampOf(events[i - 1]));
}

TEST_F(CounterSourceTest, DoesNotGoOnFromACountThatIsTooOld) {
  counts_a_second = 1e6;
  open({.ceiling = 0xFFFF}, {.bits = 16, .fastest_counts_hz = 1e6});  // half of it in 33 ms
  run(50ms);
  now += 40ms;  // nobody reads
  run(5ms);
  const auto losses = all<SourceLost>();
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_EQ(losses[0].reason, LossReason::overrun);
  EXPECT_EQ(losses[0].axes, axisBit(Axis::x));
  now += 20ms;
  run(5ms);
  EXPECT_EQ(all<SourceLost>().size(), 1U);
}

TEST_F(CounterSourceTest, TakesNoCountOfAnEventWhereItPolls) {
  open({}, {});
  run(5ms);
  const auto before = all<Count>().size();
  counts_a_second = 1e9;
  device->latch(now, now);
  counts_a_second = 0;
  run(5ms);
  EXPECT_EQ(all<Count>().size(), before + 5);
  for (const auto& count : all<Count>()) EXPECT_EQ(count.counts, 0);
  EXPECT_EQ(source->unusable(), 1U);
}

TEST_F(CounterSourceTest, CountsAnEventOfAnotherCountAsUnusable) {
  open({}, {.is_latched = true});
  run(5ms);
  latches = false;
  run(3ms);
  device->foreignEvent(500'000, now);
  latches = true;
  run(5ms);
  EXPECT_EQ(all<Count>().size(), 10U);
  for (const auto& count : all<Count>()) EXPECT_EQ(count.counts, 0);
  EXPECT_EQ(source->unusable(), 1U);
}

TEST_F(CounterSourceTest, IsGoneAloneAndComesBack) {
  counts_a_second = 1e5;
  open({}, {.axis = 5});
  run(20ms);
  device->unplug();
  run(10ms);
  ASSERT_EQ(all<SourceLost>().size(), 1U);
  EXPECT_EQ(all<SourceLost>()[0].reason, LossReason::disconnected);
  EXPECT_EQ(all<SourceLost>()[0].axes, axisBit(RotaryAxis::c));
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("disappeared"));
  const auto before = all<AngleCount>();
  run(2s);
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("unplugged"));
  EXPECT_EQ(all<AngleCount>().size(), before.size());
  device->plugIn(now);
  run(2s);
  EXPECT_EQ(source->problem(), "");
  const auto after = all<AngleCount>();
  ASSERT_GT(after.size(), before.size());
  EXPECT_EQ(after[before.size()].sequence, before.back().sequence + 1);
  EXPECT_LT(after[before.size()].counts, 100'000) << "from 0 again";
}

TEST_F(CounterSourceTest, RefusesBitsThatTheDeviceContradicts) {
  open({.ceiling = 9999}, {.bits = 16});
  EXPECT_THAT(std::string{source->problem()}, testing::AllOf(HasSubstr("9999"), HasSubstr("'bits' = 16")));
  for (const auto& [ceiling, bits] : {std::pair{std::uint64_t{99'999}, std::uint8_t{16}},
                                      {std::uint64_t{0x2FFFF}, std::uint8_t{17}},
                                      {std::uint64_t{0xFFFF'FFFF}, std::uint8_t{64}}}) {
    open({.ceiling = ceiling}, {.bits = bits});
    EXPECT_THAT(std::string{source->problem()},
                HasSubstr("wraps after its ceiling of " + std::to_string(ceiling) + ", and box.toml says 'bits'"));
  }
  for (const std::uint64_t ceiling : {std::uint64_t{0x1FF'FFFF}, ~std::uint64_t{0}}) {
    open({.ceiling = ceiling}, {.bits = 24});
    EXPECT_EQ(source->problem(), "") << "turns of 24 bits fit into its range";
  }
  open({.ceiling = std::nullopt}, {});
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("(ceiling)"));
}

}  // namespace
}  // namespace probebox::counter
