#include "protocol/frame/cobs.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

ByteVector encoded(const ByteVector& plain) {
  ByteVector coded(cobsMaxSize(plain.size()));
  coded.resize(cobsEncode(plain, coded));
  return coded;
}

// The paper's rule, written for reading: each zero-ended group becomes its length and its bytes.
ByteVector reference(const ByteVector& plain) {
  ByteVector coded;
  ByteVector group;
  const auto close = [&] {
    coded.push_back(static_cast<std::byte>(group.size() + 1));
    coded.insert(coded.end(), group.begin(), group.end());
    group.clear();
  };
  bool open = true;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    open = true;
    if (plain[k] == std::byte{0}) {
      close();
      continue;
    }
    group.push_back(plain[k]);
    if (group.size() == 254) {
      close();
      open = k + 1 < plain.size();
    }
  }
  if (open) close();
  return coded;
}

TEST(Cobs, AgreesWithExamplesOfThePaper) {
  EXPECT_EQ(encoded({}), bytes({1}));
  EXPECT_EQ(encoded(bytes({0})), bytes({1, 1}));
  EXPECT_EQ(encoded(bytes({0x11, 0x22, 0x00, 0x33})), bytes({3, 0x11, 0x22, 2, 0x33}));
  EXPECT_EQ(encoded(bytes({0x11, 0, 0, 0})), bytes({2, 0x11, 1, 1, 1}));
}

TEST(Cobs, RunsOf253To255AreTheCorners) {
  for (const std::size_t length : {253U, 254U, 255U, 508U, 509U}) {
    for (const bool ends_with_zero : {false, true}) {
      ByteVector plain(length, std::byte{7});
      if (ends_with_zero) plain.push_back(std::byte{0});
      EXPECT_EQ(encoded(plain), reference(plain)) << length << " " << ends_with_zero;
    }
  }
}

TEST(Cobs, RoundTripsWithoutZerosAndWithinItsBound) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    const auto plain = *anyBytes(1200);
    auto coded = encoded(plain);
    RC_ASSERT(coded == reference(plain));
    RC_ASSERT(std::ranges::find(coded, std::byte{0}) == coded.end());
    RC_ASSERT(coded.size() <= cobsMaxSize(plain.size()));
    const auto size = cobsDecodeInPlace(coded);
    RC_ASSERT(size.has_value());
    RC_ASSERT(std::ranges::equal(std::span{coded}.first(*size), plain));
  }));
}

TEST(Cobs, RefusesALengthBeyondTheEndAndAZeroInside) {
  auto beyond = bytes({5, 1, 2});
  EXPECT_FALSE(cobsDecodeInPlace(beyond).has_value());
  auto zero = bytes({3, 1, 0});
  EXPECT_FALSE(cobsDecodeInPlace(zero).has_value());
}

}  // namespace
}  // namespace probebox::frame
