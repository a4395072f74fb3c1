#include <array>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "firmware/modbus/rtu_requests.hpp"
#include "protocol/modbus/map.hpp"
#include "registers_entry.hpp"
#include "require.hpp"

// The fuzzer's entry without a fuzzer: requests that make sense to registers that can be written and read, on a line
// and over a connection, then the same ones damaged, the same every time.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

void putWord(Bytes& bytes, std::size_t word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

Bytes request(std::mt19937_64& random) {
  constexpr std::array<std::uint16_t, 9> kWritten{modbus::address::word_order,
                                                  modbus::address::home_position,
                                                  modbus::address::marker_run,
                                                  modbus::address::request_method,
                                                  modbus::address::request_of,
                                                  138,
                                                  144,
                                                  157,
                                                  modbus::address::home_position + 7};
  Bytes bytes{static_cast<std::uint8_t>(random() % 8 == 0 ? random() % 3 : 1),
              std::array<std::uint8_t, 6>{3, 4, 6, 16, 16, 43}[random() % 6]};
  if (bytes[1] == 43) return bytes.insert(bytes.end(), {14, static_cast<std::uint8_t>(random() % 6), 0}), bytes;
  putWord(bytes, random() % 3 == 0 ? random() % 7000 : kWritten.at(random() % kWritten.size()));
  const std::size_t count = 1 + random() % 14;
  if (bytes[1] == 6) return putWord(bytes, random() % 4), bytes;
  putWord(bytes, count);
  if (bytes[1] != 16) return bytes;
  bytes.push_back(static_cast<std::uint8_t>(2 * count));
  for (std::size_t k = 0; k < count; ++k) putWord(bytes, random() % 3 == 0 ? random() : random() % 5);
  return bytes;
}

Bytes conversation(bool on_the_network, std::mt19937_64& random) {
  Bytes all{static_cast<std::uint8_t>(on_the_network ? 1 : 0), static_cast<std::uint8_t>(random())};
  for (std::size_t k = 1 + random() % 12; k > 0; --k) {
    auto one = request(random);
    if (on_the_network) {
      putWord(all, k);
      putWord(all, 0);
      putWord(all, one.size());
    } else {
      const auto crc = modbus::crc16(one);
      one.push_back(static_cast<std::uint8_t>(crc));
      one.push_back(static_cast<std::uint8_t>(crc >> 8));
    }
    all.insert(all.end(), one.begin(), one.end());
  }
  return all;
}

void damage(Bytes& bytes, std::mt19937_64& random) {
  for (std::size_t times = 1 + random() % 5; times > 0 && bytes.size() > 3; --times) {
    const auto at = static_cast<std::ptrdiff_t>(2 + random() % (bytes.size() - 2));
    switch (random() % 3) {
      case 0:
        bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        bytes.erase(bytes.begin() + at);
        break;
      default:
        bytes.insert(bytes.begin() + at, 1 + random() % 9, static_cast<std::uint8_t>(random()));
    }
  }
}

TEST(RegistersFuzz, GoodAndDamagedRequestsAreAnsweredAsModbusAllows) {
  std::mt19937_64 random{20261124};
  EXPECT_EQ(feedRegisters(nullptr, 0), 0);
  for (int round = 0; round < fuzz::rounds(2000); ++round) {
    auto bytes = conversation(round % 2 == 1, random);
    ASSERT_EQ(feedRegisters(bytes.data(), bytes.size()), 0) << round;
    damage(bytes, random);
    ASSERT_EQ(feedRegisters(bytes.data(), bytes.size()), 0) << round;
  }
}

TEST(RegistersFuzz, NoiseIsAnsweredByNothingOrAsModbusAllows) {
  std::mt19937_64 random{5};
  for (int round = 0; round < 500; ++round) {
    Bytes noise(2 + random() % 2000);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random() % 3 == 0 ? random() : random() % 18);
    ASSERT_EQ(feedRegisters(noise.data(), noise.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
