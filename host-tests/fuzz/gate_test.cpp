#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "firmware/stream/greeting.hpp"
#include "gate_entry.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/fields.hpp"

// The fuzzer's entry without a fuzzer: a good HELLO, then the same one damaged, the same every time.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes hello(std::mt19937_64& random) {
  const auto payload = messages::encoded(messages::Hello::current());
  std::vector<std::byte> scratch(frame::bareSize(payload.size()));
  std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
  const frame::Header header{.major = messages::kProtocolMajor,
                             .type = static_cast<std::uint8_t>(messages::MessageType::hello)};
  coded.resize(frame::encodeDelimited(header, payload, scratch, coded));
  Bytes bytes{static_cast<std::uint8_t>(random())};
  for (std::size_t zeros = random() % 4; zeros > 0; --zeros) bytes.push_back(0);
  for (const auto byte : coded) bytes.push_back(std::to_integer<std::uint8_t>(byte));
  return bytes;
}

TEST(GateFuzz, LetsNothingInButHello) {
  std::mt19937_64 random{20261122};
  EXPECT_EQ(feedGate(nullptr, 0), 0);
  for (int round = 0; round < 20'000; ++round) {
    auto bytes = hello(random);
    ASSERT_EQ(feedGate(bytes.data(), bytes.size()), 0) << round;
    for (std::size_t times = 1 + random() % 4; times > 0; --times)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    if (random() % 3 == 0) bytes.resize(1 + random() % 600, static_cast<std::uint8_t>(random()));
    ASSERT_EQ(feedGate(bytes.data(), bytes.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
