#include <array>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "protocol/receiver/packet.hpp"
#include "receiver_entry.hpp"

// The fuzzer's entry without a fuzzer: good packets, then the same ones damaged, the same every time.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes stream(std::mt19937_64& random) {
  Bytes bytes{static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random())};
  std::uint32_t first = 0;
  for (std::size_t packets = 1 + random() % 12; packets > 0; --packets) {
    const std::vector<usb_probe::Sample> samples(1 + random() % (random() % 10 == 0 ? 512 : 20));
    const std::size_t counters = random() % 9;  // 0: a packet of version 1
    const std::vector<std::int64_t> counts(samples.size() * counters);
    std::vector<usb_probe::IndexLatch> latches(random() % 17);
    for (auto& latch : latches) latch = {.sample = first + static_cast<std::uint32_t>(random() % 30), .counter = 1};
    std::vector<usb_probe::LineEdge> line_edges(random() % 33);
    for (auto& edge : line_edges)
      edge = {.sample = first + static_cast<std::uint32_t>(random() % 30),
              .line = static_cast<std::uint8_t>(random() % 7),
              .level = static_cast<std::uint8_t>(random() % 2),
              .sequence = static_cast<std::uint16_t>(random())};
    const usb_probe::Edges edges{.steps_a_sample = 10'000, .edges = line_edges};
    std::vector<std::byte> packet(usb_probe::kMostPacketBytes);
    const usb_probe::Counters with{counters, counts, latches};
    const usb_probe::PacketHeader header{.first = first};
    packet.resize(random() % 3 == 0 ? usb_probe::encodePacket(header, samples, with, packet, &edges)
                  : counters == 0   ? usb_probe::encodePacket(header, samples, packet)
                                    : usb_probe::encodePacket(header, samples, with, packet));
    first += static_cast<std::uint32_t>(samples.size());
    for (const auto byte : packet) bytes.push_back(std::to_integer<std::uint8_t>(byte));
  }
  return bytes;
}

void damage(Bytes& bytes, std::mt19937_64& random) {
  for (std::size_t times = 1 + random() % 8; times > 0; --times) {
    const auto at = static_cast<std::ptrdiff_t>(random() % bytes.size());
    switch (random() % 4) {
      case 0:
        bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        bytes.erase(bytes.begin() + at);
        break;
      case 2:
        bytes.insert(bytes.begin() + at, 1 + random() % 60, static_cast<std::uint8_t>(random()));
        break;
      default: {  // a header that claims a lot
        const Bytes header{'P', 'R', 'X', '1', 1, 0, 0, 2, 1, 2, 3, 4};
        bytes.insert(bytes.begin() + at, header.begin(), header.end());
      }
    }
    if (bytes.empty()) bytes.push_back(0);
  }
}

TEST(ReceiverFuzz, AccountsForGoodAndDamagedPackets) {
  std::mt19937_64 random{20260301};
  EXPECT_EQ(feedReceiver(nullptr, 0), 0);
  for (int round = 0; round < 3000; ++round) {
    auto bytes = stream(random);
    ASSERT_EQ(feedReceiver(bytes.data(), bytes.size()), 0) << round;
    damage(bytes, random);
    ASSERT_EQ(feedReceiver(bytes.data(), bytes.size()), 0) << round;
  }
}

TEST(ReceiverFuzz, AccountsForNoise) {
  std::mt19937_64 random{8};
  for (int round = 0; round < 300; ++round) {
    Bytes noise(1 + random() % 20'000);
    for (auto& byte : noise)
      byte = random() % 3 == 0 ? static_cast<std::uint8_t>(random())
                               : std::array<std::uint8_t, 4>{'P', 'R', 'X', '1'}[random() % 4];
    ASSERT_EQ(feedReceiver(noise.data(), noise.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
