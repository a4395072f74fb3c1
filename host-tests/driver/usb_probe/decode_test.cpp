#include "drivers/usb_probe/decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <vector>

#include "drivers/usb_probe/emulator.hpp"
#include "host-tests/support/no_alloc.hpp"
#include "instants.hpp"

namespace probebox::usb_probe {
namespace {

using namespace std::chrono_literals;

// A slow sine on each channel, the third beyond the range.
std::array<Micrometres, 3> waveform(Nanoseconds since_start) {
  const double phase = toSeconds(since_start) * 10;
  return {Micrometres{100 * std::sin(phase)}, Micrometres{-40 + 0.001 * phase}, Micrometres{1500 * std::cos(phase)}};
}

std::vector<CountedDeflection> decoded(ReceiverDecoder& decoder, std::span<const std::byte> transfer,
                                       bool is_newest = true, std::size_t room = 256, MonoTime arrived = kArrived) {
  std::vector<CountedDeflection> samples;
  std::vector<Event> events(room);
  decoder.begin(transfer, arrived, is_newest);
  while (const std::size_t count = decoder.read(transfer, events)) {
    for (std::size_t i = 0; i < count; ++i) samples.push_back(std::get<CountedDeflection>(events[i]));
  }
  EXPECT_TRUE(transfer.empty());
  EXPECT_TRUE(decoder.idle());
  return samples;
}

std::vector<std::byte> packets(EmulatedReceiver& receiver, int count) {
  std::vector<std::byte> bytes;
  for (int i = 0; i < count; ++i) {
    const auto packet = receiver.packet(receiver.nextPacketAt());
    bytes.insert(bytes.end(), packet.begin(), packet.end());
  }
  return bytes;
}

TEST(EmulatedReceiver, SendsAPacketWhenItsLastSampleHasBeenTakenOnItsOwnOscillator) {
  EmulatedReceiver receiver{{.rate_hz = 1000, .offset_ppm = 100, .samples_a_packet = 10}, waveform, kStart};
  EXPECT_TRUE(receiver.packet(kStart + 9'000'899ns).empty());
  const auto packet = decodePacket(receiver.packet(kStart + 9'000'900ns));
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->header.count, 10);
  EXPECT_TRUE(receiver.packet(kStart + 9'000'900ns).empty());
  EXPECT_EQ(receiver.nextPacketAt(), kStart + 19'001'900ns);
}

TEST(ReceiverDecoder, GivesWhatTheProbeFeltInNanometres) {
  EmulatedReceiver receiver{{.rate_hz = 1000, .first_counter = 0xffff'fffa}, waveform, kStart};
  ReceiverDecoder decoder;
  const auto samples = decoded(decoder, packets(receiver, 10));
  ASSERT_EQ(samples.size(), 160U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto felt = waveform(Nanoseconds{static_cast<std::int64_t>(i) * 1'000'000});
    const auto& sample = samples[i];
    EXPECT_EQ(sample.counter, static_cast<std::uint32_t>(0xffff'fffaU + i)) << "through the wrap";
    EXPECT_NEAR(sample.channels_nm[0], 1e3 * felt[0].value(), 0.5);
    EXPECT_NEAR(sample.channels_nm[1], 1e3 * felt[1].value(), 0.5);
    EXPECT_NEAR(sample.channels_nm[2], 1e3 * std::clamp(felt[2].value(), -1000.0, 1000.0), 0.5);
    EXPECT_EQ(sample.clipped, std::abs(felt[2].value()) > 1000);
    EXPECT_EQ(sample.at, kArrived);
  }
}

TEST(ReceiverDecoder, OnlyTheSampleThatEndsTheNewestTransferTellsTheTime) {
  EmulatedReceiver receiver{{.samples_a_packet = 5}, waveform, kStart};
  ReceiverDecoder decoder;
  const auto newest = [](const std::vector<CountedDeflection>& samples) {
    std::vector<std::uint32_t> counters;
    for (const auto& sample : samples) {
      if (sample.newest) counters.push_back(sample.counter);
    }
    return counters;
  };
  using Counters = std::vector<std::uint32_t>;
  EXPECT_EQ(newest(decoded(decoder, packets(receiver, 1))), Counters{4});
  EXPECT_EQ(newest(decoded(decoder, packets(receiver, 3))), Counters{19});
  EXPECT_EQ(newest(decoded(decoder, packets(receiver, 2), false)), Counters{}) << "another one is there already";
  // A transfer that ends in mid-packet, and the one that brings the rest.
  const auto two = packets(receiver, 2);
  EXPECT_EQ(newest(decoded(decoder, std::span{two}.first(100))), Counters{});
  EXPECT_EQ(newest(decoded(decoder, std::span{two}.subspan(100))), Counters{39});
  // Garbage behind the last packet: who knows what it was.
  auto garbage = packets(receiver, 1);
  garbage.push_back(std::byte{});
  EXPECT_EQ(newest(decoded(decoder, garbage)), Counters{});
}

TEST(ReceiverDecoder, GivesAllSamplesWhateverRoomThereIs) {
  for (const std::size_t room : {1U, 2U, 7U, 16U, 17U, 64U}) {
    EmulatedReceiver receiver{{}, waveform, kStart};
    ReceiverDecoder decoder;
    const auto samples = decoded(decoder, packets(receiver, 4), true, room);
    ASSERT_EQ(samples.size(), 64U) << room;
    for (std::uint32_t i = 0; i < 64; ++i) {
      EXPECT_EQ(samples[i].counter, i);
      EXPECT_EQ(samples[i].newest, i == 63);
    }
  }
}

TEST(ReceiverDecoder, ShowsLostPacketsAndNewRunsInTheCounter) {
  EmulatedReceiver receiver{{.samples_a_packet = 8}, waveform, kStart};
  ReceiverDecoder decoder;
  packets(receiver, 1);
  receiver.losePackets(3);
  const auto after = decoded(decoder, packets(receiver, 1));
  EXPECT_TRUE(after.empty()) << "three packets of silence";
  const auto next = decoded(decoder, packets(receiver, 3));
  ASSERT_FALSE(next.empty());
  EXPECT_EQ(next.front().counter, 32U);
  EXPECT_EQ(next.front().run, 0);
  receiver.restart(5);
  const auto anew = decoded(decoder, packets(receiver, 1));
  EXPECT_EQ(anew.front().counter, 5U);
  EXPECT_EQ(anew.front().run, 1);
  EXPECT_EQ(receiver.samples() - receiver.sent(), 24U);
}

// A header that claims 511 samples must not keep back the transfers that follow.
TEST(ReceiverDecoder, WaitsForACutPacketNoLongerThanToTheNextTransfer) {
  EmulatedReceiver receiver{{.samples_a_packet = 4}, waveform, kStart};
  ReceiverDecoder decoder;
  auto claims = packets(receiver, 3);
  claims[6] = std::byte{0xFF};
  claims[7] = std::byte{1};
  EXPECT_TRUE(decoded(decoder, claims).empty());
  const auto samples = decoded(decoder, packets(receiver, 1));
  ASSERT_EQ(samples.size(), 12U) << "two packets were whole behind the damaged header";
  EXPECT_EQ(samples.front().counter, 4U);
  std::size_t newest = 0;
  for (const auto& sample : samples) newest += sample.newest ? 1U : 0U;
  EXPECT_EQ(newest, 1U);
  EXPECT_TRUE(samples.back().newest);
  EXPECT_EQ(decoder.counters().truncated, 1U);
}

TEST(ReceiverDecoder, RestartForgetsThePacketThatWasBegun) {
  EmulatedReceiver receiver{{}, waveform, kStart};
  ReceiverDecoder decoder;
  const auto bytes = packets(receiver, 2);
  std::vector<Event> events(5);
  std::span<const std::byte> left{bytes};
  decoder.begin(left, kArrived, true);
  EXPECT_EQ(decoder.read(left, events), 5U);
  EXPECT_FALSE(decoder.idle());
  decoder.restart();
  EXPECT_TRUE(decoder.idle());
  const auto samples = decoded(decoder, packets(receiver, 1));
  ASSERT_EQ(samples.size(), 16U);
  EXPECT_EQ(samples.front().counter, 32U);
}

TEST(ReceiverDecoder, NeverAllocates) {
  EmulatedReceiver receiver{{}, waveform, kStart};
  auto bytes = packets(receiver, 100);
  bytes[300] ^= std::byte{1};
  const auto decoder = std::make_unique<ReceiverDecoder>();
  std::vector<Event> events(64);
  std::uint64_t samples = 0;
  const support::NoAlloc guard;
  std::span<const std::byte> left{bytes};
  decoder->begin(left, kArrived, true);
  while (const std::size_t count = decoder->read(left, events)) samples += count;
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_EQ(samples, 99U * 16);
}

// White noise of a known size on a slow motion, and a square wave on the loop-back line.
TEST(InputFigures, ShowTheNoiseOfTheSamplesAndThePeriodsOfTheLoopBack) {
  constexpr std::uint32_t kSteps = 10'000;
  std::mt19937 random{7};
  std::normal_distribution<double> noise{0, 0.2};
  EmulatedReceiver receiver{{.rate_hz = 2000, .range_um = 100, .samples_a_packet = 16, .steps_a_sample = kSteps},
                            [&](Nanoseconds at) {
                              const double s = 1e-9 * static_cast<double>(at.count());
                              return std::array{Micrometres{50 * std::sin(s) + noise(random)},
                                                Micrometres{2 * noise(random)}, Micrometres{s < 0.01 ? 200.0 : 0.0}};
                            },
                            kStart};
  ReceiverDecoder decoder;
  bool level = false;
  auto edge_at = kStart;
  for (int i = 0; i < 128; ++i) {
    for (; edge_at < receiver.nextPacketAt(); edge_at += std::chrono::microseconds{500})
      receiver.edge(ReceiverLine::loop_back, level = !level, edge_at);
    EXPECT_EQ(decoder.inputs().windows(), 0U);
    decoded(decoder, packets(receiver, 1));
  }
  ASSERT_EQ(decoder.inputs().windows(), 1U);
  const auto& seen = decoder.inputs().last();
  EXPECT_EQ(seen.samples, 2048U);
  EXPECT_NEAR(seen.noise_nm[0], 200, 20);
  EXPECT_NEAR(seen.noise_nm[1], 400, 40);
  EXPECT_EQ(seen.clipped, 20U);
  EXPECT_EQ(seen.highest_nm[2], 100'000);
  EXPECT_EQ(seen.lowest_nm[2], 0);
  EXPECT_NEAR(seen.loop_back_periods, 1023, 2);
  EXPECT_GE(seen.shortest_period_steps, 2 * kSteps - 1) << "1 ms at 2000 samples a second";
  EXPECT_LE(seen.longest_period_steps, 2 * kSteps + 1);
}

// A gap is no noise, and a period over lost edges none.
TEST(InputFigures, LeaveOutWhatIsMissing) {
  EmulatedReceiver receiver{{.rate_hz = 2000, .samples_a_packet = 16, .steps_a_sample = 10'000},
                            [](Nanoseconds at) {
                              const double s = 1e-9 * static_cast<double>(at.count());
                              return std::array{Micrometres{400 * s}, Micrometres{}, Micrometres{}};
                            },
                            kStart};
  ReceiverDecoder decoder;
  bool level = false;
  auto edge_at = kStart;
  for (int i = 0; decoder.inputs().windows() == 0; ++i) {
    if (i % 10 == 5) receiver.losePackets(3);
    for (; edge_at < receiver.nextPacketAt(); edge_at += std::chrono::microseconds{500})
      receiver.edge(ReceiverLine::loop_back, level = !level, edge_at);
    decoded(decoder, packets(receiver, 1));
  }
  const auto& seen = decoder.inputs().last();
  EXPECT_LT(seen.noise_nm[0], 1) << "a steady motion, to the digit";
  EXPECT_EQ(seen.shortest_period_steps, seen.longest_period_steps);
  EXPECT_LT(seen.loop_back_periods, 1024U);
}

}  // namespace
}  // namespace probebox::usb_probe
