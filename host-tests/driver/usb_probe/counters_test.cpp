#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "drivers/usb_probe/decode.hpp"
#include "drivers/usb_probe/emulator.hpp"
#include "host-tests/support/no_alloc.hpp"
#include "instants.hpp"

// Packets of versions 2 and 3: axis counts, index latches and edges on the sample counter of the deflections.
namespace probebox::usb_probe {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kX = 0, kZ = 2, kC = 5;

// Counter 0 is Z, 2 is X with its index, 3 is C; 1 is not wired.
CounterAxes wiring() {
  CounterAxes axes{};
  axes[0] = {kZ, false};
  axes[2] = {kX, true};
  axes[3] = {kC, false};
  return axes;
}

EmulatedReceiver receiver(std::size_t counters, std::uint32_t first = 0) {
  return EmulatedReceiver{{.rate_hz = 1000, .samples_a_packet = 4, .first_counter = first, .counters = counters},
                          [](Nanoseconds t) {
                            return std::array<Micrometres, 3>{Micrometres{toSeconds(t)}, {}, {}};
                          },
                          kStart,
                          [](Nanoseconds t) {
                            std::array<std::int64_t, kMostCounters> counts{};
                            for (std::size_t i = 0; i < counts.size(); ++i)
                              counts[i] = static_cast<std::int64_t>(i + 1) * 1'000'000'000'000 + t.count() / 1000;
                            return counts;
                          }};
}

std::vector<Event> eventsOf(ReceiverDecoder& decoder, std::span<const std::byte> transfer, std::size_t room = 256) {
  std::vector<Event> all;
  std::vector<Event> events(room);
  decoder.begin(transfer, kArrived, true);
  while (const std::size_t count = decoder.read(transfer, events))
    all.insert(all.end(), events.begin(), events.begin() + static_cast<std::ptrdiff_t>(count));
  EXPECT_TRUE(decoder.idle());
  return all;
}

TEST(AxisCounters, FollowTheDeflectionOfTheirSampleWithTheSameNumber) {
  auto device = receiver(4, 0xffff'fffe);
  ReceiverDecoder decoder{wiring()};
  for (const std::size_t room : {1U, 2U, 3U, 64U}) {
    const auto taken = device.samples();
    const auto packet = device.packet(device.nextPacketAt());
    const auto events = eventsOf(decoder, packet, room);
    ASSERT_EQ(events.size(), 8U);
    for (std::uint32_t i = 0; i < 4; ++i) {
      const auto& deflection = std::get<CountedDeflection>(events[2 * i]);
      const auto& axes = std::get<CountedAxes>(events[2 * i + 1]);
      EXPECT_EQ(axes.counter, static_cast<std::uint32_t>(0xffff'fffe + taken + i));
      EXPECT_EQ(axes.counter, deflection.counter);
      EXPECT_EQ(deflection.newest, i == 3);
      EXPECT_EQ(axes.axes, 1U << kX | 1U << kZ | 1U << kC);
      const auto us = static_cast<std::int64_t>(1000 * (taken + i));
      EXPECT_EQ(axes.counts[kZ], 1'000'000'000'000 + us);
      EXPECT_EQ(axes.counts[kX], 3'000'000'000'000 + us);
      EXPECT_EQ(axes.counts[kC], 4'000'000'000'000 + us);
      EXPECT_EQ(axes.faults, 0);
    }
  }
  EXPECT_EQ(decoder.axisCounters(), 4U);
}

// U on counter 1, whose counts are half of those of X, and fall where those of X rise.
TEST(AxisCounters, AddASecondaryAxisToItsPrimaryAxis) {
  auto axes = wiring();
  axes[1] = {kX, false, -2};
  auto device = receiver(4);
  ReceiverDecoder decoder{axes};
  device.breakWire(1);
  const auto events = eventsOf(decoder, device.packet(device.nextPacketAt()));
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& counted = std::get<CountedAxes>(events[2 * i + 1]);
    const auto us = static_cast<std::int64_t>(1000 * i);
    EXPECT_EQ(counted.counts[kX], 3'000'000'000'000 + us - 2 * (2'000'000'000'000 + us));
    EXPECT_EQ(counted.faults, 1U << kX) << "a broken wire of U";
  }
  // Without the counter of either there is no sum.
  auto fewer = receiver(2);
  const auto without = eventsOf(decoder, fewer.packet(fewer.nextPacketAt()));
  EXPECT_EQ(std::get<CountedAxes>(without[1]).axes, 1U << kZ);
  EXPECT_EQ(letterOf(*axes[1]), 'U');
}

TEST(AxisCounters, OfAReceiverWithoutWiredAxesAreLeftOut) {
  auto device = receiver(4);
  ReceiverDecoder decoder;
  device.pulse(2, kStart + 1'500us);
  EXPECT_EQ(eventsOf(decoder, device.packet(device.nextPacketAt())).size(), 4U);
}

TEST(AxisCounters, SayWhichOfThemLostCounts) {
  auto device = receiver(4);
  ReceiverDecoder decoder{wiring()};
  device.breakWire(2);
  device.breakWire(1);
  const auto events = eventsOf(decoder, device.packet(device.nextPacketAt()));
  EXPECT_EQ(std::get<CountedAxes>(events[1]).faults, 1U << kX);
}

TEST(IndexLatches, ComeBetweenTheSamplesThatTheyLieBetween) {
  auto device = receiver(4, 100);
  ReceiverDecoder decoder{wiring()};
  device.pulse(2, kStart + 1'250us);
  device.pulse(0, kStart + 1'500us);  // its index is not used
  device.pulse(2, kStart + 3'750us);
  const auto events = eventsOf(decoder, device.packet(device.nextPacketAt()));
  ASSERT_EQ(events.size(), 10U);
  const auto& between = std::get<CountedIndex>(events[4]);
  EXPECT_EQ(between.counter, 101U);
  EXPECT_NEAR(std::ldexp(between.fraction, -32), 0.25, 1e-9);
  EXPECT_EQ(between.axis, kX);
  EXPECT_EQ(between.counts, 3'000'000'001'250);
  EXPECT_EQ(std::get<CountedDeflection>(events[5]).counter, 102U);
  const auto& last = std::get<CountedIndex>(events[9]);
  EXPECT_EQ(last.counter, 103U);
  EXPECT_NEAR(std::ldexp(last.fraction, -32), 0.75, 1e-9);
  // One that came with the packet after: before its first sample.
  device.packet(device.nextPacketAt());
  device.pulse(2, kStart + 7'500us);
  const auto later = eventsOf(decoder, device.packet(device.nextPacketAt()));
  EXPECT_EQ(std::get<CountedIndex>(later[0]).counter, 107U);
  EXPECT_EQ(std::get<CountedDeflection>(later[1]).counter, 108U);
}

// Line 0 is sync, 2 the first trigger and active low, 3 inhibit; 1 is not wired.
WiredLines lines() {
  return {WiredLine{LineRole::sync, 0, false}, std::nullopt, WiredLine{LineRole::trigger, 0, true},
          WiredLine{LineRole::inhibit, 1, false}};
}

EmulatedReceiver receiverWithEdges(std::uint32_t first = 0) {
  return EmulatedReceiver{
      {.rate_hz = 1000, .samples_a_packet = 4, .first_counter = first, .counters = 1, .steps_a_sample = 10'000},
      [](Nanoseconds) { return std::array<Micrometres, 3>{}; },
      kStart,
      [](Nanoseconds) { return std::array<std::int64_t, kMostCounters>{}; }};
}

std::vector<CountedEdge> edgesOf(const std::vector<Event>& events) {
  std::vector<CountedEdge> edges;
  for (const auto& event : events)
    if (const auto* const edge = std::get_if<CountedEdge>(&event)) edges.push_back(*edge);
  return edges;
}

TEST(ReceiverEdges, ComeBetweenTheSamplesThatTheyLieBetweenInTheOrderOfTheirTimes) {
  CounterAxes axes{};
  axes[0] = {kX, true};
  auto device = receiverWithEdges(0xffff'fffe);
  ReceiverDecoder decoder{axes, lines()};
  device.edge(ReceiverLine::sync, true, kStart + 1'250us);
  device.pulse(0, kStart + 1'300us);
  device.edge(ReceiverLine::trigger_1, true, kStart + 1'400us);  // is not wired
  device.edge(ReceiverLine::trigger_2, true, kStart + 1'500us);
  const auto events = eventsOf(decoder, device.packet(device.nextPacketAt()));
  const auto& sync = std::get<CountedEdge>(events.at(4));
  EXPECT_EQ(sync.role, LineRole::sync);
  EXPECT_EQ(sync.counter, 0xffff'ffffU);
  EXPECT_NEAR(std::ldexp(sync.fraction, -32), 0.25, 1e-4);
  EXPECT_EQ(sync.level, Level::active);
  EXPECT_TRUE(std::holds_alternative<CountedIndex>(events.at(5)));
  const auto& trigger = std::get<CountedEdge>(events.at(6));
  EXPECT_EQ(trigger.role, LineRole::trigger);
  EXPECT_EQ(trigger.level, Level::inactive) << "active low";
  EXPECT_EQ(std::get<CountedDeflection>(events.at(7)).counter, 0U);
}

TEST(ReceiverEdges, BeginWithTheLevelsAndFindWhatWasLost) {
  auto device = receiverWithEdges();
  ReceiverDecoder decoder{{}, lines()};
  auto edges = edgesOf(eventsOf(decoder, device.packet(device.nextPacketAt())));
  ASSERT_EQ(edges.size(), 2U) << "of trigger and inhibit: a probe may be in contact, and a cut may be on";
  EXPECT_EQ(edges[0].role, LineRole::trigger);
  EXPECT_EQ(edges[0].level, Level::active);
  EXPECT_EQ(edges[1].role, LineRole::inhibit);
  EXPECT_EQ(edges[1].line, 1);
  EXPECT_EQ(edges[1].level, Level::inactive);
  device.edge(ReceiverLine::inhibit, true, kStart + 4'500us);
  edges = edgesOf(eventsOf(decoder, device.packet(device.nextPacketAt())));
  ASSERT_EQ(edges.size(), 1U);
  const auto known = edges[0].line_sequence;
  // A packet with an edge is lost: the level is told, and the next edge shows the gap.
  device.losePackets(1);
  device.edge(ReceiverLine::inhibit, false, kStart + 8'500us);
  EXPECT_TRUE(device.packet(device.nextPacketAt()).empty());
  edges = edgesOf(eventsOf(decoder, device.packet(device.nextPacketAt())));
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(edges[0].level, Level::inactive);
  EXPECT_EQ(edges[0].line_sequence, known);
  device.edge(ReceiverLine::inhibit, true, kStart + 16'500us);
  edges = edgesOf(eventsOf(decoder, device.packet(device.nextPacketAt())));
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(edges[0].line_sequence, known + 2);
}

TEST(AxisCounters, TakeNoMemory) {
  auto device = receiver(4);
  ReceiverDecoder decoder{wiring()};
  device.pulse(2, kStart + 1'250us);
  auto packet = device.packet(device.nextPacketAt());
  std::array<Event, 64> events;
  const support::NoAlloc guard;
  decoder.begin(packet, kArrived, true);
  EXPECT_EQ(decoder.read(packet, events), 9U);
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace probebox::usb_probe
