#include "protocol/frame/crc32c.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <string_view>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

// Bit by bit, as the definition says.
std::uint32_t bitwiseCrc(std::span<const std::byte> data) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const auto byte : data) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0x82F63B78U : crc >> 1U;
  }
  return ~crc;
}

ByteVector ramp(int first, int step) {
  ByteVector all(32);
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<std::byte>(first + step * static_cast<int>(k));
  return all;
}

// RFC 3720, appendix B.4, where the CRCs are written as bytes in order of transmission.
TEST(Crc32c, AgreesWithRfc3720) {
  EXPECT_EQ(crc32c(ByteVector(32, std::byte{0x00})), 0x8A9136AAU);
  EXPECT_EQ(crc32c(ByteVector(32, std::byte{0xFF})), 0x62A8AB43U);
  EXPECT_EQ(crc32c(ramp(0, 1)), 0x46DD794EU);
  EXPECT_EQ(crc32c(ramp(31, -1)), 0x113FDB5CU);
  const auto read_command =
      bytes({0x01, 0xc0, 0, 0,    0, 0, 0, 0,    0,    0, 0, 0, 0, 0, 0, 0, 0x14, 0, 0, 0, 0, 0, 0x04, 0,
             0,    0,    0, 0x14, 0, 0, 0, 0x18, 0x28, 0, 0, 0, 0, 0, 0, 0, 0x02, 0, 0, 0, 0, 0, 0,    0});
  EXPECT_EQ(crc32c(read_command), 0xD9963A56U);
}

TEST(Crc32c, OfTheDigitsIsTheCheckValue) {
  EXPECT_EQ(crc32c(std::as_bytes(std::span{std::string_view{"123456789"}})), 0xE3069283U);
}

TEST(Crc32c, EveryWayGivesTheSame) {
  EXPECT_TRUE(rc::check("table, instruction and bit-by-bit agree at any length and alignment", [] {
    const auto data = *anyBytes(300);
    const auto skip = *rc::gen::inRange<std::size_t>(0, std::min<std::size_t>(data.size(), 8) + 1);
    const auto part = std::span{data}.subspan(skip);
    RC_ASSERT(crc32cByTable(part) == bitwiseCrc(part));
    RC_ASSERT(crc32c(part) == bitwiseCrc(part));
    if (hasCrc32cInstruction()) RC_ASSERT(crc32cByInstruction(part) == bitwiseCrc(part));
  }));
}

TEST(Crc32c, ContinuesWhereItStopped) {
  EXPECT_TRUE(rc::check("crc(b, crc(a)) is crc(ab)", [] {
    const auto data = *anyBytes(100);
    const auto cut = *rc::gen::inRange<std::size_t>(0, data.size() + 1);
    const auto head = std::span{data}.first(cut);
    const auto tail = std::span{data}.subspan(cut);
    RC_ASSERT(crc32c(tail, crc32c(head)) == bitwiseCrc(data));
    RC_ASSERT(crc32cByTable(tail, crc32cByTable(head)) == bitwiseCrc(data));
  }));
}

}  // namespace
}  // namespace probebox::frame
