#include <array>
#include <chrono>
#include <cstdint>
#include <gtest/gtest.h>
#include <thread>

#include "firmware/app/threads/command_queue.hpp"
#include "firmware/app/threads/event_queue.hpp"
#include "firmware/app/threads/spsc_queue.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "firmware/app/threads/triple_buffer.hpp"

namespace probebox::app {
namespace {

TEST(SpscQueue, KeepsOrderAndRefusesWhatDoesNotFit) {
  SpscQueue<int> queue{3};
  ASSERT_EQ(queue.capacity(), 4U);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_FALSE(queue.push(4));
  int value = -1;
  ASSERT_TRUE(queue.pop(value));
  EXPECT_EQ(value, 0);
  EXPECT_TRUE(queue.push(5));
  for (const int expected : {1, 2, 3, 5}) {
    ASSERT_TRUE(queue.pop(value));
    EXPECT_EQ(value, expected);
  }
  EXPECT_FALSE(queue.pop(value));
}

TEST(SpscQueue, HandsEveryValueFromOneThreadToTheOther) {
  constexpr std::uint64_t kValues = 200'000;
  SpscQueue<std::uint64_t> queue{64};
  std::thread producer{[&queue] {
    for (std::uint64_t i = 0; i < kValues; ++i) {
      while (!queue.push(i)) std::this_thread::yield();
    }
  }};
  std::uint64_t expected = 0;
  while (expected < kValues) {
    std::uint64_t value = 0;
    if (!queue.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(value, expected);
    ++expected;
  }
  producer.join();
}

TEST(TripleBuffer, ShowsWholeValuesThatNeverGoBack) {
  constexpr std::uint64_t kValues = 100'000;
  using Value = std::array<std::uint64_t, 40>;  // larger than what a processor writes at once
  TripleBuffer<Value> buffer;
  std::thread writer{[&buffer] {
    for (std::uint64_t i = 1; i <= kValues; ++i) {
      Value value;
      value.fill(i);
      buffer.publish(value);
    }
  }};
  std::uint64_t last = 0;
  while (last < kValues) {
    const Value& value = buffer.newest();
    for (const auto part : value) ASSERT_EQ(part, value.front());
    ASSERT_GE(value.front(), last);
    last = value.front();
  }
  writer.join();
}

// Events of several sizes, so that some lie across the end of the ring.
Event numbered(std::uint32_t number) {
  if (number % 7 == 0) return ProcedureStarted{.run = number, .options = {.stations = 7, .mounts = 3}};
  if (number % 3 == 0) return ErrorsAtAngle{.errors = {1, 2, 3, 4, 5, double(number)}, .at = monoTime(number)};
  return Edge{.line_sequence = number, .at = monoTime(number)};
}

void expectNumbered(const Event& event, std::uint32_t number) {
  if (number % 7 == 0) {
    const auto& started = std::get<ProcedureStarted>(event);
    EXPECT_EQ(started.run, number);
    EXPECT_EQ(started.options.mounts, 3);
  } else if (number % 3 == 0) {
    EXPECT_EQ(std::get<ErrorsAtAngle>(event).errors[5], number);
  } else {
    EXPECT_EQ(std::get<Edge>(event).line_sequence, number);
  }
}

TEST(EventQueue, KeepsOrderOfEventsOfAnySizeAndRefusesWhatDoesNotFit) {
  EventQueue queue{1000};
  std::uint32_t pushed = 0;
  std::uint32_t popped = 0;
  Event event;
  for (int round = 0; round < 1000; ++round) {
    while (queue.push(numbered(pushed))) ++pushed;
    // 1024 bytes hold 42 edges, or three starts of a run.
    ASSERT_GE(queue.size(), 3U);
    ASSERT_LE(queue.size(), 42U);
    ASSERT_EQ(queue.size(), pushed - popped);
    for (int i = 0; i <= round % 5 && queue.pop(event); ++i) expectNumbered(event, popped++);
  }
  while (queue.pop(event)) expectNumbered(event, popped++);
  EXPECT_EQ(popped, pushed);
  EXPECT_EQ(queue.size(), 0U);
}

TEST(EventQueue, HoldsTheLargestEventHoweverSmallItWasMade) {
  EventQueue queue{1};
  Event event;
  EXPECT_TRUE(queue.push(numbered(7)));
  ASSERT_TRUE(queue.pop(event));
  expectNumbered(event, 7);
}

TEST(EventQueue, HandsEveryEventFromOneThreadToTheOther) {
  constexpr std::uint32_t kEvents = 100'000;
  EventQueue queue{2048};
  std::thread producer{[&queue] {
    for (std::uint32_t i = 0; i < kEvents; ++i) {
      while (!queue.push(numbered(i))) std::this_thread::yield();
    }
  }};
  Event event;
  for (std::uint32_t expected = 0; expected < kEvents;) {
    if (queue.pop(event)) {
      expectNumbered(event, expected++);
    } else {
      std::this_thread::yield();
    }
  }
  producer.join();
}

TEST(CommandQueue, TakesCommandsOfManyThreads) {
  constexpr std::uint32_t kEach = 1000;
  CommandQueue queue;
  const auto command = [&queue](std::uint32_t who) {
    for (std::uint32_t i = 0; i < kEach; ++i) {
      while (!queue.push(ProcedureAborted{.run = who, .at = monoTime(i)})) std::this_thread::yield();
    }
  };
  std::thread first{command, 0U};
  std::thread second{command, 1U};
  std::array<std::int64_t, 2> next{};
  while (next[0] + next[1] < 2 * kEach) {
    Event event;
    if (!queue.pop(event)) {
      std::this_thread::yield();
      continue;
    }
    const auto& aborted = std::get<ProcedureAborted>(event);
    EXPECT_EQ(toNs(aborted.at), next[aborted.run]++);  // in the order of each thread
  }
  first.join();
  second.join();
}

TEST(EventQueue, IsHalfFullBeforeItRefuses) {
  EventQueue queue{4096};
  EXPECT_FALSE(queue.isHalfFull());
  int pushed = 0;
  while (!queue.isHalfFull()) ASSERT_TRUE(queue.push(TimeAdvanced{})) << ++pushed;
  EXPECT_TRUE(queue.push(TimeAdvanced{}));
  Event event;
  while (queue.pop(event)) {
  }
  EXPECT_FALSE(queue.isHalfFull());
}

// The second command is seen by nobody before a state is published behind it.
TEST(CommandQueue, SaysWhichCommandsEachReaderOfTheStateCanSee) {
  CommandQueue commands;
  ASSERT_TRUE(commands.push(TimeAdvanced{}));
  ASSERT_TRUE(commands.push(TimeAdvanced{}));
  EXPECT_EQ(commands.pushed(), 2U);
  Event event;
  ASSERT_TRUE(commands.pop(event));
  commands.setPublished();
  EXPECT_EQ(commands.published(), 0U) << "published while it was applied";
  commands.setApplied();
  commands.setPublished();
  EXPECT_EQ(commands.published(), 1U);
  ASSERT_TRUE(commands.pop(event));
  commands.setApplied();
  EXPECT_EQ(commands.published(), 1U);
  commands.setPublished();
  EXPECT_EQ(commands.published(), commands.pushed());
}

TEST(TimeSource, LeadsTheEmulatedMachineNoFasterThanItIsFollowed) {
  using namespace std::chrono_literals;
  TimeSource time{10};
  const auto start = time.now();
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(time.now(), start) << "goes on in advance() alone";
  EXPECT_EQ(time.advance(true), start) << "held";
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(time.advance(false) - start, 50ms) << "5 ms at a time";
}

}  // namespace
}  // namespace probebox::app
