#include "firmware/app/cnc/register_desk.hpp"

#include <gtest/gtest.h>

#include "host-tests/numbered/snapshot.hpp"

// What a controller is known to have read: after the end of a box it decides where the joints stand.
namespace probebox::app {
namespace {

class Desk : public testing::Test {
 protected:
  void answer(const modbus::Request& request) {
    EXPECT_EQ(desk_.answer(request).kind, RegisterDesk::Answer::Kind::answered);
  }
  void read(std::uint16_t first, std::uint16_t count) { answer(support::readRequest(first, count)); }

  std::uint32_t number_{1};
  std::uint64_t served_{};  // number of the snapshot whose correction was read last

 private:
  RegisterDesk desk_{1,
                     "1.2.3",
                     {.snapshot = [this] { return support::numbered(number_); },
                      .take = [](std::span<const Event>) { return true; },
                      .kept = [] { return RegisterDesk::Kept{}; },
                      .serves = [this](const published::Snapshot& snapshot) { served_ = snapshot.produced_samples; }}};
};

TEST_F(Desk, KnowsThatACorrectionWasReadInEveryFormat) {
  for (const auto& [first, count] :
       {std::pair{0, 13}, {0, 6}, {7, 1}, {10, 5}, {16, 2}, {21, 1}, {32, 6}, {37, 40}, {0, 122}}) {
    ++number_;
    read(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(count));
    EXPECT_EQ(served_, number_) << first << " " << count;
  }
}

TEST_F(Desk, TakesNoOtherRequestForIt) {
  for (const auto& [first, count] : {std::pair{0, 5}, {11, 5}, {22, 10}, {38, 80}, {96, 8}}) {
    ++number_;
    read(static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(count));
    EXPECT_EQ(served_, 0U) << first << " " << count;
  }
  auto cut = support::readRequest(138, 1);
  cut.bytes[1] = 6;
  const auto crc = modbus::crc16(std::span{cut.bytes}.first(6));
  cut.bytes[6] = static_cast<std::uint8_t>(crc);
  cut.bytes[7] = static_cast<std::uint8_t>(crc >> 8U);
  answer(cut);
  EXPECT_EQ(served_, 0U) << "an inhibit is written";
}

}  // namespace
}  // namespace probebox::app
