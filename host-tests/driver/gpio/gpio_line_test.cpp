#include "firmware/app/wiring/gpio_line.hpp"

#include <array>
#include <gmock/gmock.h>
#include <optional>

#include "mock_chip.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class GpioLineOnAChip : public ::testing::Test {
 protected:
  void SetUp() override {
    chip_ = gpio::makeMockChip({{"TOUCH", false, ""}});
    if (!chip_) GTEST_SKIP() << "the real gpio driver is not tested: install libumockdev-dev and configure again";
    line_.emplace(gpio::ChipLines{
        "gpiochip7", {{"probe", 0U, {0, LineRole::trigger, 0, board::ActiveLevel::high, gpio::Edges::both}}}});
  }

  // How many of what was read are losses.
  int lossesAt(Nanoseconds at) {
    std::array<Event, 16> events{};
    const auto count = line_->read(events, MonoTime{at});
    int losses = 0;
    for (std::size_t i = 0; i < count; ++i) losses += std::holds_alternative<SourceLost>(events[i]) ? 1 : 0;
    return losses;
  }

  std::unique_ptr<gpio::MockChip> chip_;
  std::optional<GpioLine> line_;  // lets go before the chip does
};

TEST_F(GpioLineOnAChip, IsAskedForAtOnceAndThenEverySecond) {
  chip_->unplug(ENODEV);
  EXPECT_EQ(lossesAt(10s), 0) << "what was never had is not lost";
  EXPECT_THAT(line_->problem(), HasSubstr("gpio chip"));
  chip_->plugIn();
  lossesAt(10'999ms);
  EXPECT_THAT(line_->problem(), HasSubstr("gpio chip"));
  lossesAt(11s);
  EXPECT_THAT(line_->problem(), IsEmpty());
  EXPECT_GE(line_->descriptor(), 0);
}

TEST_F(GpioLineOnAChip, SaysWhyItIsGoneAsSoonAsItIs) {
  lossesAt(10s);
  ASSERT_THAT(line_->problem(), IsEmpty());
  chip_->unplug(ENODEV);
  EXPECT_EQ(lossesAt(10'100ms), 1);
  EXPECT_THAT(line_->problem(), HasSubstr("gpio chip"));
  EXPECT_EQ(line_->descriptor(), -1);
}

TEST_F(GpioLineOnAChip, GetsNoMoreThanATryASecondFromAChipThatComesAndGoes) {
  lossesAt(5s);
  chip_->unplug(0);
  chip_->plugIn();
  EXPECT_EQ(lossesAt(10s), 1);
  EXPECT_THAT(line_->problem(), IsEmpty()) << "it was back at once";
  chip_->unplug(0);
  chip_->plugIn();
  EXPECT_EQ(lossesAt(10'300ms), 1);
  EXPECT_THAT(line_->problem(), HasSubstr("keeps disappearing"));
  lossesAt(10'999ms);
  EXPECT_THAT(line_->problem(), HasSubstr("keeps disappearing"));
  lossesAt(11s);
  EXPECT_THAT(line_->problem(), IsEmpty());
}

}  // namespace
}  // namespace probebox::app
