#include "protocol/frame/frame.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

ByteVector bare(const Header& header, const ByteVector& payload) {
  ByteVector all(bareSize(payload.size()));
  EXPECT_EQ(encodeBare(header, payload, all), all.size());
  return all;
}

const Header kHeader{.major = 1,
                     .type = 8,
                     .flags = 0,
                     .stream = 1,
                     .payload_length = 0,
                     .sequence = 0x01020304,
                     .descriptor_hash = 0xA0B0C0D0};

// Frozen: these bytes are in recordings.
TEST(Frame, HasTheLayoutOfItsDecision) {
  EXPECT_EQ(bare(kHeader, bytes({0x55, 0x00, 0xAA})),
            bytes({1, 8, 0, 1, 3, 0, 4, 3, 2, 1, 0xD0, 0xC0, 0xB0, 0xA0, 0x55, 0x00, 0xAA, 0x16, 0xB7, 0xEB, 0x98}));
}

TEST(Frame, BareRoundTrips) {
  EXPECT_TRUE(rc::check("decodeBare(encodeBare(x)) == x", [] {
    const auto payload = *anyBytes(300);
    auto header = kHeader;
    header.type = *rc::gen::arbitrary<std::uint8_t>();
    header.sequence = *rc::gen::arbitrary<std::uint32_t>();
    const auto all = bare(header, payload);
    header.payload_length = static_cast<std::uint16_t>(payload.size());
    const auto frame = decodeBare(all);
    RC_ASSERT(frame.ok());
    RC_ASSERT(frame->header == header);
    RC_ASSERT(std::ranges::equal(frame->payload, payload));
  }));
}

TEST(Frame, AnyFlippedBitIsSeen) {
  const auto good = bare(kHeader, bytes({1, 2, 3, 0, 5}));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    EXPECT_FALSE(decodeBare(bad).ok()) << bit;
  }
}

TEST(Frame, AnyOtherLengthIsSeen) {
  auto all = bare(kHeader, bytes({1, 2, 3}));
  for (std::size_t size = 0; size < all.size(); ++size)
    EXPECT_FALSE(decodeBare(std::span{all}.first(size)).ok()) << size;
  all.push_back(std::byte{0});
  const auto longer = decodeBare(all);
  ASSERT_FALSE(longer.ok());
  EXPECT_EQ(longer.error(), FrameFault::bad_length);
}

TEST(Frame, WithoutRoomNothingIsEncoded) {
  const auto payload = bytes({1, 2, 3});
  ByteVector small(bareSize(payload.size()) - 1);
  EXPECT_EQ(encodeBare(kHeader, payload, small), 0U);
  const ByteVector too_long(0x10000);
  ByteVector large(bareSize(too_long.size()));
  EXPECT_EQ(encodeBare(kHeader, too_long, large), 0U);
  ByteVector scratch(bareSize(payload.size()));
  const std::size_t enough = delimitedMaxSize(payload.size());
  ByteVector coded(enough, std::byte{0xEE});
  EXPECT_EQ(encodeDelimited(kHeader, payload, scratch, std::span{coded}.first(enough - 1)), 0U);
  EXPECT_EQ(coded, ByteVector(enough, std::byte{0xEE}));
  EXPECT_GT(encodeDelimited(kHeader, payload, scratch, coded), 0U);
}

}  // namespace
}  // namespace probebox::frame
