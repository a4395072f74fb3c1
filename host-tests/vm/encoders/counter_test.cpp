#include <array>
#include <chrono>
#include <ctime>
#include <gmock/gmock.h>
#include <memory>
#include <poll.h>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "counter_sim.hpp"
#include "drivers/counter/counter_source.hpp"
#include "drivers/counter/linux_counter.hpp"
#include "drivers/io/summed_source.hpp"
#include "host-tests/support/events_of.hpp"
#include "kernel_files.hpp"

// The real driver on the kernel's own counter core; the test makes counts and events of its devices (counter-sim.c).
namespace probebox::counter {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const std::string kFolder = "/sys/bus/counter/devices/counter0/";

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

void count(std::uint64_t value) {
  vm::writeTo(kFolder + "count0/count", std::to_string(value));
}
void ceiling(std::uint64_t value) {
  vm::writeTo(kFolder + "count0/ceiling", std::to_string(value));
}
void bind(const std::string& verb) {
  vm::writeTo("/sys/bus/platform/drivers/counter-sim/" + verb, "counter-sim.0");
}

class CounterOfTheKernel : public testing::Test {
 protected:
  CounterOfTheKernel() { ceiling(0xFFFF'FFFF), count(0); }

  static std::unique_ptr<CounterSource> counter(board::CounterEncoder described, const char* device = "counter-sim.0") {
    described.device = device;
    const CounterConfig config{
        .device = device, .is_latched = described.latched_by != board::LatchedBy::polling, .interval = 1ms};
    return std::make_unique<CounterSource>(std::make_unique<LinuxCounter>(described, 'X', config.interval), config);
  }
  const CounterSource& open(const board::CounterEncoder& described) {
    auto opened = counter(described);
    const auto& result = *opened;
    source = std::move(opened);
    read();
    return result;
  }
  void read() {
    std::array<Event, 64> batch;
    while (const std::size_t got = source->read(batch, now()))
      events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(got));
  }
  // Waits as the capture thread does, until there are so many counts.
  bool readUntil(std::size_t counts) {
    for (int i = 0; i < 60'000 && all<Count>().size() < counts; ++i) {
      pollfd waiting{source->descriptor(), POLLIN, 0};
      ::poll(&waiting, 1, 1);
      read();
    }
    return all<Count>().size() >= counts;
  }
  template <class T>
  std::vector<T> all() const {
    return support::eventsOf<T>(events);
  }

  std::unique_ptr<io::EventSource> source;
  std::vector<Event> events;
};

TEST_F(CounterOfTheKernel, IsPolledWithStampsOfItsOwn) {
  const auto before = now();
  const auto& opened = open({});
  ASSERT_EQ(source->problem(), "");
  count(4711);
  ASSERT_TRUE(readUntil(50));
  const auto counts = all<Count>();
  EXPECT_EQ(counts.back().counts, 4711);
  EXPECT_GT(counts.front().at, before);
  EXPECT_LT(counts.back().at, now());
  for (std::size_t i = 1; i < counts.size(); ++i) EXPECT_GT(counts[i].at, counts[i - 1].at);
  EXPECT_GT(opened.stampSd().count(), 0);
}

TEST_F(CounterOfTheKernel, IsUnwrappedAtSixteenAndThirtyTwoBits) {
  for (const std::uint64_t top : {0xFFFFULL, 0xFFFF'FFFFULL}) {
    events.clear();
    ceiling(top);
    count(top - 10);
    open({});
    ASSERT_TRUE(readUntil(3)) << source->problem();
    count(20);
    ASSERT_TRUE(readUntil(all<Count>().size() + 3));
    EXPECT_EQ(all<Count>().back().counts, static_cast<std::int64_t>(top) + 21);
    count(top - 100);
    ASSERT_TRUE(readUntil(all<Count>().size() + 3));
    EXPECT_EQ(all<Count>().back().counts, static_cast<std::int64_t>(top) - 100);
    EXPECT_TRUE(all<SourceLost>().empty());
  }
}

TEST_F(CounterOfTheKernel, IsLatchedByAnEventThatTheKernelStamps) {
  open({.latched_by = board::LatchedBy::capture,
        .latch_channel = 1,
        .latched_value = board::LatchedValue::capture,
        .has_index = true});
  ASSERT_EQ(source->problem(), "");
  for (std::uint64_t i = 0; i < 100; ++i) {
    count(1000 + i);
    const auto before = now();
    vm::writeTo(kFolder + "capture_pulse", "1");
    const auto after = now();
    count(0);  // gone on meanwhile: the captured value counts
    if (i == 50) vm::writeTo(kFolder + "index_pulse", "0");
    read();
    ASSERT_EQ(all<Count>().size() + source->unusable(), i + 1);
    if (source->unusable() > 0) continue;  // two within half a period: the guest was slow
    EXPECT_EQ(all<Count>().back().counts, static_cast<std::int64_t>(1000 + i));
    EXPECT_GE(all<Count>().back().at, before);
    EXPECT_LE(all<Count>().back().at, after);
    while (now() - before < 1ms) continue;
  }
  ASSERT_EQ(all<Edge>().size(), 1U);
  EXPECT_EQ(all<Edge>()[0].role, LineRole::index);
}

TEST_F(CounterOfTheKernel, RefusesEventsThatItDoesNotKnow) {
  open({.latched_by = board::LatchedBy::change_of_state});
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("does not report this event"));
  vm::writeTo(kFolder + "count0/enable", "0");
  open({});
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("is not enabled"));
  vm::writeTo(kFolder + "count0/enable", "1");
}

TEST_F(CounterOfTheKernel, IsUnpluggedWhileItIsReadAndComesBack) {
  open({.has_index = true});
  count(77);
  ASSERT_TRUE(readUntil(5));
  bind("unbind");
  for (int i = 0; i < 60'000 && all<SourceLost>().empty(); ++i) {
    pollfd waiting{source->descriptor(), POLLIN, 0};
    ::poll(&waiting, 1, 1);
    read();
  }
  ASSERT_EQ(all<SourceLost>().size(), 1U);
  EXPECT_EQ(all<SourceLost>()[0].axes, axisBit(Axis::x));
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("disappeared"));
  bind("bind");
  const auto had = all<Count>().size();
  ASSERT_TRUE(readUntil(had + 5)) << source->problem();
  EXPECT_EQ(all<Count>()[had].sequence, all<Count>()[had - 1].sequence + 1);
  EXPECT_EQ(all<Count>().back().counts, 0) << "it counts from 0 again";
}

TEST_F(CounterOfTheKernel, IsAddedToThatOfItsPrimaryAxis) {
  source = std::make_unique<io::SummedSource>(counter({}), counter({}, "counter-sim.3"), -2.0);
  vm::CounterSim quill{3};
  count(1000);
  quill.count(300);
  read();
  ASSERT_TRUE(readUntil(10)) << source->problem();
  EXPECT_EQ(all<Count>().back().counts, 400);
  quill.unplug();
  for (int i = 0; i < 60'000 && all<SourceLost>().empty(); ++i) read();
  ASSERT_EQ(all<SourceLost>().size(), 1U);
  EXPECT_THAT(std::string{source->problem()}, HasSubstr("counter-sim.3 disappeared"));
  quill.plugIn();
  quill.count(100);
  events.clear();
  ASSERT_TRUE(readUntil(10)) << source->problem();
  EXPECT_EQ(all<Count>().back().counts, 800);
}

}  // namespace
}  // namespace probebox::counter
