#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <poll.h>
#include <string>
#include <thread>
#include <vector>

#include "box_user.hpp"
#include "drivers/gpio/linux_gpio.hpp"
#include "gpio_sim.hpp"
#include "line_holder.hpp"

// The real driver on real lines: the kernel's gpio simulator, libgpiod, and nothing in between.
namespace probebox::gpio {
namespace {

using board::ActiveLevel;
using testing::AllOf;
using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr const char* kLabel = "bench";
constexpr unsigned kSync = 0;
constexpr unsigned kTrigger = 1;
constexpr unsigned kSkip = 2;

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(time.tv_sec * 1'000'000'000 + time.tv_nsec);
}

ChipLines syncLine() {
  return {kLabel, {{"sync", kSync, {0, LineRole::sync, 0, ActiveLevel::high, Edges::active}}}};
}
ChipLines triggerLine() {
  return {kLabel, {{"probe", std::string{"TOUCH"}, {0, LineRole::trigger, 0, ActiveLevel::low, Edges::both}}}};
}
ChipLines skipLine() {
  return {kLabel, {{"skip", kSkip, {0, LineRole::skip, 0, ActiveLevel::high, Edges::both}}}};
}

// The box's user opens the lines; the test, which moves the wires, is root.
Outcome<void> acquireAsBoxUser(LinuxGpio& line) {
  const vm::AsBoxUser user;
  EXPECT_TRUE(user.taken());
  return line.acquire();
}

std::unique_ptr<LinuxGpio> opened(const ChipLines& lines) {
  auto line = std::make_unique<LinuxGpio>(lines);
  const auto acquired = acquireAsBoxUser(*line);
  EXPECT_TRUE(acquired) << acquired.error().what;
  return line;
}

std::vector<Event> readAll(LinuxGpio& line) {
  std::vector<Event> all;
  std::array<Event, 256> batch{};
  while (const auto count = line.read(batch, now())) all.insert(all.end(), batch.begin(), batch.begin() + count);
  return all;
}

std::vector<Edge> edgesOf(const std::vector<Event>& events) {
  std::vector<Edge> edges;
  for (const auto& event : events) edges.push_back(std::get<Edge>(event));
  return edges;
}

// What a line that counts from 1 has told, and what the gaps in its count say.
struct Tally {
  void take(const Edge& edge) {
    if (edge.line_sequence == last) return;  // a level told again
    lost += edge.line_sequence - last - 1;
    last = edge.line_sequence;
    ++seen;
  }
  std::uint32_t last{};
  std::uint64_t seen{};
  std::uint64_t lost{};
};

Tally tallyOf(const std::vector<Event>& events) {
  Tally tally;
  for (const auto& edge : edgesOf(events)) tally.take(edge);
  return tally;
}

class LinesOfTheKernel : public testing::Test {
 protected:
  // Unplugs the chip while this line is watched as the capture thread does, and returns what it tells. Linux 6.1 does
  // not wake who waits for a line when its chip goes.
  std::vector<Event> unplugUnder(LinuxGpio& line) {
    std::thread hand{[this] { chip.unplug(); }};
    std::vector<Event> events;
    for (int ms = 0; events.empty() && ms < 60'000; ++ms) {
      pollfd waiting{line.descriptor(), POLLIN, 0};
      poll(&waiting, 1, 1);
      events = readAll(line);
    }
    hand.join();
    return events;
  }

  vm::GpioSim chip{kLabel, {"", "TOUCH", ""}};
};

TEST_F(LinesOfTheKernel, StampEveryEdgeBetweenTheMomentsBeforeAndAfterItWasMade) {
  const auto sync = opened(syncLine());
  std::vector<std::pair<MonoTime, MonoTime>> made;
  for (int i = 0; i < 500; ++i) {
    const auto before = now();
    chip.drive(kSync, true);
    made.emplace_back(before, now());
    chip.drive(kSync, false);  // a tick is the active edge alone
  }
  const auto edges = edgesOf(readAll(*sync));
  ASSERT_EQ(edges.size(), made.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_GE(edges[i].at, made[i].first);
    EXPECT_LE(edges[i].at, made[i].second);
    EXPECT_EQ(edges[i].line_sequence, i + 1);
    EXPECT_EQ(edges[i].level, Level::active);
    EXPECT_EQ(edges[i].role, LineRole::sync);
  }
}

TEST_F(LinesOfTheKernel, TellTouchesByNameAndPolarityAndFirstTheLevelThatIsThere) {
  const auto trigger = opened(triggerLine());
  chip.drive(kTrigger, true);
  chip.drive(kTrigger, false);
  const auto edges = edgesOf(readAll(*trigger));
  ASSERT_EQ(edges.size(), 3U);
  EXPECT_EQ(edges[0].level, Level::active) << "low is active, and the wire was low: in contact";
  EXPECT_EQ(edges[0].line_sequence, 0U);
  EXPECT_EQ(edges[0].at, edges[1].at);
  EXPECT_EQ(edges[1].level, Level::inactive);
  EXPECT_EQ(edges[2].level, Level::active);
  EXPECT_GT(edges[2].at, edges[1].at);
}

TEST_F(LinesOfTheKernel, CountWhatFellOutOfTheKernelsBufferExactly) {
  const auto sync = opened(syncLine());
  for (int i = 0; i < 10; ++i) chip.pulse(kSync);
  std::array<Event, 4> few{};
  ASSERT_EQ(sync->read(few, now()), 4U);
  for (int i = 0; i < 4990; ++i) chip.pulse(kSync);
  Tally tally;
  for (const auto& event : few) tally.take(std::get<Edge>(event));
  for (const auto& edge : edgesOf(readAll(*sync))) tally.take(edge);
  EXPECT_EQ(tally.seen + tally.lost, 5000U);
  EXPECT_EQ(tally.seen, 4 + 1024U) << "the kernel keeps the newest 1024";
  EXPECT_EQ(tally.last, 5000U);
}

TEST_F(LinesOfTheKernel, TellALossBeforeTheFirstEdgeThatWasEverRead) {
  const auto sync = opened(syncLine());
  for (int i = 0; i < 2000; ++i) chip.pulse(kSync);
  const auto tally = tallyOf(readAll(*sync));
  EXPECT_EQ(tally.seen, 1024U);
  EXPECT_EQ(tally.lost, 976U);
}

TEST_F(LinesOfTheKernel, KeepTheirEdgesWhenAnotherLineChatters) {
  const auto sync = opened(syncLine());
  const auto skip = opened(skipLine());
  for (int i = 0; i < 100; ++i) {
    chip.pulse(kSync);
    for (int bounce = 0; bounce < 20; ++bounce) chip.pulse(kSkip);
  }
  EXPECT_EQ(tallyOf(readAll(*sync)).seen, 100U);
  const auto chatter = tallyOf(readAll(*skip));
  EXPECT_EQ(chatter.seen, 1024U);
  EXPECT_EQ(chatter.seen + chatter.lost, 4000U);
}

TEST_F(LinesOfTheKernel, LoseNoEdgeAtTenThousandASecond) {
  constexpr std::uint32_t kEdges = 20'000;
  constexpr Nanoseconds kPace = 100us;
  const auto skip = opened(skipLine());
  Tally tally;
  std::vector<MonoTime> stamps;
  stamps.reserve(kEdges + 1);
  // As the capture thread reads: it waits for the descriptor, then takes all there is.
  std::thread reader{[&] {
    std::array<Event, 256> batch{};
    pollfd waiting{skip->descriptor(), POLLIN, 0};
    while (tally.last < kEdges && poll(&waiting, 1, 10'000) == 1) {
      while (const auto count = skip->read(batch, now())) {
        for (std::size_t i = 0; i < count; ++i) {
          tally.take(std::get<Edge>(batch[i]));
          stamps.push_back(stampOf(batch[i]));
        }
      }
    }
  }};
  auto due = now();
  for (std::uint32_t i = 0; i < kEdges; ++i) {
    while (now() < due) {
    }
    chip.drive(kSkip, i % 2 == 0);
    due += kPace;
  }
  reader.join();
  EXPECT_EQ(tally.seen, kEdges);
  EXPECT_EQ(tally.lost, 0U);
  EXPECT_TRUE(std::is_sorted(stamps.begin(), stamps.end()));
  // The rate was what it is said to be.
  const double rate = (kEdges - 1) * 1e9 / static_cast<double>((stamps.back() - stamps.front()).count());
  EXPECT_NEAR(rate, 10'000, 10);
  std::printf("%u edges at %.0f a second, %llu lost\n", kEdges, rate, static_cast<unsigned long long>(tally.lost));
}

TEST_F(LinesOfTheKernel, AreRefusedWhileSomebodyElseHoldsThemByName) {
  LinuxGpio trigger{triggerLine()};
  {
    const vm::LineHolder holder{chip.chip(), kTrigger, "spindle-monitor"};
    ASSERT_TRUE(holder.holds());
    const auto refused = acquireAsBoxUser(trigger);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().what, AllOf(HasSubstr(kLabel), HasSubstr("\"TOUCH\" (probe)"),
                                            HasSubstr("held by 'spindle-monitor'"), HasSubstr("give the box another")));
    EXPECT_TRUE(opened(skipLine())) << "its neighbours are free";
  }
  EXPECT_TRUE(acquireAsBoxUser(trigger));
  chip.pulse(kTrigger);
  EXPECT_EQ(tallyOf(readAll(trigger)).seen, 2U);
}

TEST_F(LinesOfTheKernel, AreRefusedWhenTheChipHasNone) {
  auto by_name = triggerLine();
  by_name.lines[0].address = std::string{"TUCH"};
  auto by_offset = syncLine();
  by_offset.lines[0].address = 3U;
  for (const auto& wrong : {by_name, by_offset}) {
    LinuxGpio line{wrong};
    const auto refused = acquireAsBoxUser(line);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().what, AllOf(HasSubstr("bench has no line"), HasSubstr("gpioinfo")));
  }
}

TEST_F(LinesOfTheKernel, AreRefusedWithoutTheRightToTheChip) {
  chip.unplug();
  chip.plugInWithoutRights();
  LinuxGpio line{syncLine()};
  const auto refused = acquireAsBoxUser(line);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, AllOf(HasSubstr(kLabel), HasSubstr(chip.chip()), HasSubstr("no permission"),
                                          HasSubstr("sudo adduser $USER gpio")));
  chip.grant();
  EXPECT_TRUE(acquireAsBoxUser(line));
}

TEST_F(LinesOfTheKernel, AreLostWithTheirChipAndComeBackWithIt) {
  const auto trigger = opened(triggerLine());
  chip.pulse(kTrigger);
  EXPECT_EQ(tallyOf(readAll(*trigger)).seen, 2U);

  for (int time = 1; time <= 5; ++time) {
    SCOPED_TRACE(time);
    const auto events = unplugUnder(*trigger);
    ASSERT_EQ(events.size(), 1U);
    EXPECT_EQ(std::get<SourceLost>(events[0]).source, Source::trigger);
    EXPECT_EQ(std::get<SourceLost>(events[0]).reason, LossReason::disconnected);
    EXPECT_TRUE(trigger->lost());
    EXPECT_EQ(trigger->descriptor(), -1);
    const auto away = acquireAsBoxUser(*trigger);
    ASSERT_FALSE(away);
    EXPECT_THAT(away.error().what, HasSubstr("bench: there is no such gpio chip; gpiodetect lists"));

    chip.plugIn();
    ASSERT_TRUE(acquireAsBoxUser(*trigger));
    chip.pulse(kTrigger);
    const auto back = edgesOf(readAll(*trigger));
    ASSERT_EQ(back.size(), 3U);
    const auto before = static_cast<std::uint32_t>(2 * time);
    EXPECT_EQ(back[0].line_sequence, before) << "the level that is there; no edge, and no loss is claimed";
    EXPECT_EQ(back[0].level, Level::active);
    EXPECT_EQ(back[1].line_sequence, before + 1);
    EXPECT_EQ(back[2].line_sequence, before + 2);
  }
}

}  // namespace
}  // namespace probebox::gpio
