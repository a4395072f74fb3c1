#include "drivers/iio/scan_format.hpp"

#include <array>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace probebox::iio {
namespace {

using ::testing::ElementsAre;

std::int64_t value(const char* format, std::initializer_list<unsigned> bytes) {
  std::vector<std::byte> raw;
  for (const auto byte : bytes) raw.push_back(static_cast<std::byte>(byte));
  return readValue(*parseScanFormat(format), raw);
}

TEST(ScanFormat, ReadsTheKernelsText) {
  const auto format = parseScanFormat("be:s24/32>>8");
  ASSERT_TRUE(format.ok());
  EXPECT_EQ(*format,
            (ScanFormat{.big_endian = true, .is_signed = true, .real_bits = 24, .storage_bits = 32, .shift = 8}));
  EXPECT_EQ(format->least(), -8388608);
  EXPECT_EQ(format->greatest(), 8388607);
  EXPECT_EQ(parseScanFormat("le:u12/16>>4")->greatest(), 4095);
  EXPECT_EQ(parseScanFormat("le:u12/16>>4")->least(), 0);
}

TEST(ScanFormat, RefusesWhatIsNoSingleNumber) {
  for (const char* const text :
       {"", "le", "le:s16", "le:s16/16", "xe:s16/16>>0", "le:f32/32>>0", "le:s16/16X3>>0", "le:s16/15>>0",
        "le:s0/16>>0", "le:s16/16>>1", "le:s16/16>>0 ", "le:s99999999999/16>>0"}) {
    const auto format = parseScanFormat(text);
    ASSERT_FALSE(format.ok()) << text;
    EXPECT_NE(format.error().what.find("choose another channel"), std::string::npos);
  }
}

TEST(ScanFormat, ReadsValuesAsConvertersStoreThem) {
  EXPECT_EQ(value("le:s16/16>>0", {0xFE, 0xFF}), -2);
  EXPECT_EQ(value("be:s16/16>>0", {0xFF, 0xFE}), -2);
  EXPECT_EQ(value("le:u16/16>>0", {0xFE, 0xFF}), 65534);
  EXPECT_EQ(value("le:s12/16>>4", {0xF0, 0x7F}), 2047);
  EXPECT_EQ(value("le:s12/16>>4", {0x0F, 0x80}), -2048) << "the low bits are not of the value";
  EXPECT_EQ(value("be:s24/32>>8", {0x80, 0x00, 0x00, 0x12}), -8388608);
  EXPECT_EQ(value("le:s64/64>>0", {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}), -1);
}

RC_GTEST_PROP(ScanFormat, ReadsWhatItWrote, ()) {
  const unsigned storage = *rc::gen::element(8U, 16U, 32U, 64U);
  const unsigned real = *rc::gen::inRange(2U, std::min(storage, 63U) + 1);
  const ScanFormat format{.big_endian = *rc::gen::arbitrary<bool>(),
                          .is_signed = *rc::gen::arbitrary<bool>(),
                          .real_bits = real,
                          .storage_bits = storage,
                          .shift = *rc::gen::inRange(0U, storage - real + 1)};
  const auto wanted = *rc::gen::arbitrary<std::int64_t>();
  std::array<std::byte, 8> bytes{};
  writeValue(format, wanted, bytes);
  RC_ASSERT(readValue(format, bytes) == std::clamp(wanted, format.least(), format.greatest()));
}

TEST(ScanFormat, AlignsEachChannelToItsSizeAndTheFrameToTheLargest) {
  const auto s16 = *parseScanFormat("le:s16/16>>0"), s32 = *parseScanFormat("le:s24/32>>0");
  const std::array with_stamp{s16, s32, s16, kStampFormat};
  EXPECT_THAT(layOut(with_stamp).offsets, ElementsAre(0U, 4U, 8U, 16U));
  EXPECT_EQ(layOut(with_stamp).bytes, 24U);
  const std::array without{s32, s16};
  EXPECT_EQ(layOut(without).bytes, 8U);
}

}  // namespace
}  // namespace probebox::iio
