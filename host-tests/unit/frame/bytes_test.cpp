#include "protocol/frame/bytes.hpp"

#include <array>
#include <gtest/gtest.h>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

TEST(Bytes, AreLittleEndianWhateverTheMachine) {
  ByteVector all(8 + 4 + 1 + 8 + 8);
  ByteWriter writer{all};
  writer.put(std::int64_t{-2});
  writer.put(std::uint32_t{0x01020304});
  writer.put(true);
  writer.put(monoTime(0x1122));
  writer.put(1.0);
  EXPECT_TRUE(writer.complete());
  EXPECT_EQ(all, bytes({0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 4, 3, 2, 1, 1,    0x22, 0x11,
                        0,    0,    0,    0,    0,    0,    0,    0,    0, 0, 0, 0, 0xF0, 0x3F}));
  ByteReader reader{all};
  EXPECT_EQ(reader.get<std::int64_t>(), -2);
  EXPECT_EQ(reader.get<std::uint32_t>(), 0x01020304U);
  EXPECT_TRUE(reader.get<bool>());
  EXPECT_EQ(reader.get<MonoTime>(), monoTime(0x1122));
  EXPECT_EQ(reader.get<double>(), 1.0);
  EXPECT_FALSE(reader.failed());
}

TEST(Bytes, AWriterWithoutRoomStillCounts) {
  std::array<std::byte, 3> small{};
  ByteWriter writer{small};
  writer.put(std::uint16_t{1});
  writer.put(std::uint32_t{2});
  EXPECT_FALSE(writer.complete());
  EXPECT_EQ(writer.size(), 6U);
}

TEST(Bytes, AReaderBeyondTheEndHasFailedForGood) {
  const auto all = bytes({1, 2, 3});
  ByteReader reader{all};
  EXPECT_EQ(reader.get<std::uint32_t>(), 0U);
  EXPECT_TRUE(reader.failed());
  EXPECT_EQ(reader.get<std::uint8_t>(), 0U);
  EXPECT_TRUE(reader.failed());
}

}  // namespace
}  // namespace probebox::frame
