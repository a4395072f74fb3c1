#include "firmware/front_end/core/assembly.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <rapidcheck.h>
#include <vector>

#include "host-tests/support/no_alloc.hpp"

namespace probebox::front_end {
namespace {

using usb_probe::ReceiverFault;

// A stamp as the hardware makes it.
std::uint32_t stampAt(std::uint64_t step, std::uint32_t levels) {
  return static_cast<std::uint32_t>(0 - step) << kStampedPins | levels;
}

Latched latchedWith(const std::array<std::uint32_t, kCounters>& counts) {
  return {.counts = counts, .has_deflection = true, .deflection = {100, -100, 0}};
}

struct Fixture {
  std::unique_ptr<Assembly> assembly = std::make_unique<Assembly>();

  explicit Fixture(const Settings& settings = {.steps_a_sample = 10'000, .samples_a_packet = 4}) {
    assembly->start(settings, 3);
  }
  void sample(const Latched& latched = latchedWith({})) {
    assembly->sample(latched);
    for (int i = 0; i < 50; ++i) assembly->work();
  }
  void packetOfSamples() {
    for (unsigned i = 0; i < assembly->settings().samples_a_packet; ++i) sample();
  }
  std::vector<std::byte> front() const {
    const auto* const held = assembly->packets().front();
    if (held == nullptr) return {};
    return {held->bytes.begin(), held->bytes.begin() + static_cast<std::ptrdiff_t>(held->size)};
  }
};

std::uint16_t faultsOf(const std::vector<std::byte>& packet) {
  return usb_probe::decodePacket(packet)->of_edges.faults;
}

TEST(Assembly, MakesThePacketsOfTheBoxesOwnEncoder) {
  EXPECT_TRUE(rc::check("packets are those that encodePacket makes", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    const Settings settings{.steps_a_sample = static_cast<std::uint32_t>(kLeastSteps + random() % 20'000),
                            .samples_a_packet = static_cast<std::uint16_t>(1 + random() % kMostSamplesAPacket),
                            .full_scale_nm = {500'000, -250'000, 1'000'000}};
    Fixture fixture{settings};
    std::array<std::uint32_t, kCounters> counts{};
    std::array<std::int64_t, kCounters> totals{};
    std::uint32_t next = 0;
    for (int packets = 0; packets < 5; ++packets) {
      std::vector<usb_probe::Sample> samples;
      std::vector<std::int64_t> expected;
      for (unsigned i = 0; i < settings.samples_a_packet; ++i) {
        Latched latched{.has_deflection = true};
        for (std::size_t k = 0; k < kCounters; ++k) {
          const auto moved = static_cast<std::int32_t>(random() % 200) - 100;
          totals[k] += moved;
          latched.counts[k] = counts[k] += static_cast<std::uint32_t>(moved);
          expected.push_back(totals[k]);
        }
        auto& sample = samples.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
          latched.deflection[c] = static_cast<std::int16_t>(random() % 65'000 - 32'500);
          sample.channels_nm[c] =
              static_cast<std::int32_t>(std::int64_t{settings.full_scale_nm[c]} * latched.deflection[c] / 32'768);
        }
        fixture.sample(latched);
      }
      std::vector<std::byte> bytes(usb_probe::kMostPacketBytes);
      const usb_probe::Edges edges{settings.steps_a_sample, 0, {}};
      bytes.resize(encodePacket({.run = 3, .first = next}, samples, {kCounters, expected, {}}, bytes, &edges));
      RC_ASSERT(fixture.front() == bytes);
      fixture.assembly->taken();
      next += settings.samples_a_packet;
    }
  }));
}

TEST(Assembly, PutsEdgesOnTheSampleCounterToAStep) {
  EXPECT_TRUE(rc::check("sample and fraction are the time of the edge", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    const auto steps = static_cast<std::uint32_t>(kLeastSteps + random() % 100'000);
    Fixture fixture{{.steps_a_sample = steps, .samples_a_packet = 1}};
    // Also after the stamps have wrapped.
    const auto before = static_cast<std::uint32_t>(2 + random() % 5000);
    for (std::uint32_t i = 0; i < before; ++i) {
      fixture.sample();
      fixture.assembly->taken();
    }
    const std::uint64_t at = std::uint64_t{before} * steps - random() % (2 * steps);
    fixture.assembly->lines(stampAt(at, 1U << 1U));
    fixture.sample();
    const auto bytes = fixture.front();
    const auto packet = usb_probe::decodePacket(bytes);
    RC_ASSERT(packet->of_edges.edges == 1);
    const auto edge = packet->edge(0);
    RC_ASSERT(edge.line == 1 && edge.level == 1 && edge.sequence == 1 && edge.lost == 0);
    const double period = steps;
    const double stamped = period * (edge.sample + std::ldexp(edge.fraction, -32));
    RC_ASSERT(std::abs(stamped - (static_cast<double>(at) - 0.5)) < 0.01);
  }));
}

TEST(Assembly, TakesTheFirstStampForTheLevelsToBeginWith) {
  Fixture fixture;
  fixture.assembly->lines(stampAt(0, 0b01001));
  fixture.assembly->lines(stampAt(100, 0b01000));
  fixture.packetOfSamples();
  const auto bytes = fixture.front();
  const auto packet = usb_probe::decodePacket(bytes);
  ASSERT_EQ(packet->of_edges.edges, 1);
  EXPECT_EQ(packet->of_edges.levels, 0b01000);
  EXPECT_EQ(packet->edge(0).line, 0);
  EXPECT_EQ(packet->edge(0).level, 0);
}

TEST(Assembly, DeclaresEdgesThatDoNotFit) {
  Fixture fixture;
  for (unsigned i = 0; i < usb_probe::kMostEdges + 3; ++i) fixture.assembly->lines(stampAt(10 + 10 * i, (i + 1) % 2));
  fixture.packetOfSamples();
  EXPECT_TRUE(faultsOf(fixture.front()) & bitOf(ReceiverFault::edges_lost));
  fixture.assembly->taken();
  fixture.assembly->lines(stampAt(41'000, 0));
  fixture.packetOfSamples();
  const auto bytes = fixture.front();
  const auto edge = usb_probe::decodePacket(bytes)->edge(0);
  EXPECT_EQ(edge.lost, 3);
  EXPECT_EQ(edge.sequence, usb_probe::kMostEdges + 4);
  EXPECT_EQ(fixture.assembly->counters().edges_lost, 3U);
  EXPECT_EQ(faultsOf(bytes), 0) << "the host has taken the packet that said it";
}

TEST(Assembly, LatchesAnIndexPulseWithItsCount) {
  Fixture fixture;
  fixture.sample(latchedWith({0, 0, 0xFFFF'FFF0, 0}));  // 16 back
  fixture.assembly->index(stampAt(15'000, 0b00100), {5, 5, 0xFFFF'FFEC, 5});
  fixture.assembly->index(stampAt(16'000, 0), {});
  for (int i = 0; i < 3; ++i) fixture.sample(latchedWith({0, 0, 0xFFFF'FFE0, 0}));
  const auto bytes = fixture.front();
  const auto packet = usb_probe::decodePacket(bytes);
  ASSERT_EQ(packet->more.latches, 1);
  const auto latch = packet->latch(0);
  EXPECT_EQ(latch.counter, 2);
  EXPECT_EQ(latch.counts, -20);
  EXPECT_EQ(latch.sample, 1U);
  EXPECT_NEAR(std::ldexp(latch.fraction, -32), 0.49995, 1e-6);
  EXPECT_EQ(packet->count(3, 2), -32);
}

TEST(Assembly, KeepsTheFaultOfACounterUntilAPacketWithItIsTaken) {
  Fixture fixture;
  auto illegal = latchedWith({});
  illegal.illegal = 0b0010;
  fixture.sample(illegal);
  for (int i = 0; i < 7; ++i) fixture.sample();
  for (int packets = 0; packets < 2; ++packets) {
    const auto bytes = fixture.front();
    EXPECT_EQ(usb_probe::decodePacket(bytes)->sample(3).status, 1U << (usb_probe::status::kFirstCounterFault + 1));
    fixture.assembly->taken();
  }
  fixture.packetOfSamples();
  const auto bytes = fixture.front();
  EXPECT_EQ(usb_probe::decodePacket(bytes)->sample(0).status, 0);
}

TEST(Assembly, NamesAnAxisThatMovesFasterThanItsCounterHolds) {
  Fixture fixture;  // 480 us a sample: 6 million counts a second are 2880
  fixture.sample(latchedWith({2880, 2881, 0, 0}));
  for (int i = 0; i < 3; ++i) fixture.sample(latchedWith({2880, 2881, 0, 0}));
  const auto bytes = fixture.front();
  EXPECT_EQ(usb_probe::decodePacket(bytes)->sample(0).status, 1U << (usb_probe::status::kFirstCounterFault + 1));
  EXPECT_EQ(faultsOf(bytes), bitOf(ReceiverFault::counter_overrun));
  EXPECT_EQ(fixture.assembly->counters().overruns[1], 1U);
}

TEST(Assembly, NamesAConverterThatIsSilentOrLateAndABrokenWire) {
  for (const bool late : {false, true}) {
    Fixture fixture;
    for (int i = 0; i < 4; ++i) fixture.sample({.broken = 0b1000, .is_late = late});
    const auto bytes = fixture.front();
    EXPECT_EQ(faultsOf(bytes), bitOf(late ? ReceiverFault::deflections_late : ReceiverFault::converter_silent) |
                                   bitOf(ReceiverFault::wires_4));
    EXPECT_TRUE(usb_probe::decodePacket(bytes)->sample(0).status & usb_probe::status::kClipped);
  }
}

TEST(Assembly, DropsAndCountsWholePacketsWhenNobodyReads) {
  Fixture fixture;
  for (std::size_t i = 0; i < PacketRing::kPackets + 3; ++i) fixture.packetOfSamples();
  EXPECT_EQ(fixture.assembly->counters().samples_dropped, 12U);
  for (std::size_t i = 0; i < PacketRing::kPackets; ++i) {
    EXPECT_EQ(usb_probe::decodePacket(fixture.front())->header.first, 4 * i);
    fixture.assembly->taken();
  }
  fixture.packetOfSamples();
  const auto bytes = fixture.front();
  EXPECT_EQ(usb_probe::decodePacket(bytes)->header.first, 4 * (PacketRing::kPackets + 3));
  EXPECT_EQ(faultsOf(bytes), bitOf(ReceiverFault::samples_dropped));
  // A new host gets nothing that is old.
  fixture.assembly->discard();
  EXPECT_TRUE(fixture.front().empty());
  fixture.packetOfSamples();
  EXPECT_EQ(faultsOf(fixture.front()), 0);
}

TEST(Assembly, TakesNoMemory) {
  Fixture fixture;
  const support::NoAlloc guard;
  for (unsigned i = 0; i < 100; ++i) {
    fixture.assembly->lines(stampAt(1 + 5000 * i, i % 32));
    fixture.assembly->index(stampAt(1 + 5000 * i, i % 32), {});
    fixture.sample();
  }
  EXPECT_EQ(guard.allocations(), 0U);
}

TEST(FrontEndSettings, AreCheckedByName) {
  EXPECT_EQ(whyRefused({}), RefusalCode::none);
  EXPECT_EQ(whyRefused({.steps_a_sample = kLeastSteps - 1}), RefusalCode::bad_steps_a_sample);
  EXPECT_EQ(whyRefused({.steps_a_sample = kMostSteps + 1}), RefusalCode::bad_steps_a_sample);
  EXPECT_EQ(whyRefused({.samples_a_packet = 0}), RefusalCode::bad_samples_a_packet);
  EXPECT_EQ(whyRefused({.samples_a_packet = 33}), RefusalCode::bad_samples_a_packet);
  EXPECT_EQ(whyRefused({.sync_out_steps = 0}), RefusalCode::none);
  EXPECT_EQ(whyRefused({.sync_out_steps = 7}), RefusalCode::bad_sync_out_steps);
  EXPECT_EQ(whyRefused({.full_scale_nm = {1, 0, 1}}), RefusalCode::bad_full_scale);
}

}  // namespace
}  // namespace probebox::front_end
