#include "drivers/gpio/loop_back.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <vector>

#include "drivers/gpio/loop_back_emulator.hpp"
#include "drivers/gpio/stamp_lateness.hpp"
#include "mock_chip.hpp"

namespace probebox::gpio {
namespace {

using board::ActiveLevel;
using std::chrono::microseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

board::LoopBack lines(unsigned output = 0, unsigned input = 1) {
  return {.output = {"loop-back output", "gpiochip7", output, ActiveLevel::high},
          .input = {"loop-back input", "gpiochip7", input, ActiveLevel::high}};
}

// Pulses that are stamped so late, each after a write of `write_ns`; below 0: lost.
std::vector<LoopBackPulse> pulsesOf(const std::vector<int>& late_ns, int write_ns = 3000) {
  std::vector<LoopBackPulse> all;
  MonoTime at = monoTime(7'000'000);
  for (const int late : late_ns) {
    all.push_back({.before = at, .after = at + Nanoseconds{write_ns}, .stamp = {}});
    if (late >= 0) all.back().stamp = at + Nanoseconds{late};
    at += microseconds{900};
  }
  return all;
}

TEST(StampLateness, IsCountedFromJustBeforeTheWrite) {
  const auto late = stampLateness(pulsesOf({9000, 11000, 10000, -1, 90000}), lines());
  ASSERT_TRUE(late) << late.error().what;
  EXPECT_EQ(late->pulses, 5U);
  EXPECT_EQ(late->lost, 1U);
  EXPECT_EQ(late->median, Nanoseconds{10500});
  EXPECT_EQ(late->p99, Nanoseconds{90000});
  EXPECT_EQ(late->largest, Nanoseconds{90000});
  EXPECT_EQ(late->bracket, Nanoseconds{3000});
  EXPECT_EQ(late->sigma, Nanoseconds{1483}) << "distances 500, 500, 1500, 79500: an outlier does not count";
}

// Counted, not sorted: as many lie below as above, and 99 of 100 are no later.
RC_GTEST_PROP(StampLateness, HasHalfOfThePulsesOnEitherSideAndOneInAHundredBeyond, ()) {
  auto late_ns = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 100'000));
  RC_PRE(!late_ns.empty());
  const auto late = stampLateness(pulsesOf(late_ns), lines());
  RC_ASSERT(late.ok());
  const auto count = [&](auto is) { return static_cast<std::size_t>(std::ranges::count_if(late_ns, is)); };
  const auto median = late->median.count(), p99 = late->p99.count();
  RC_ASSERT(2 * count([&](int ns) { return ns < median; }) <= late_ns.size());
  RC_ASSERT(2 * count([&](int ns) { return ns > median + 1; }) <= late_ns.size());
  RC_ASSERT(100 * count([&](int ns) { return ns > p99; }) <= late_ns.size());
  RC_ASSERT(100 * count([&](int ns) { return ns >= p99; }) > late_ns.size() - 1);
  RC_ASSERT(late->largest.count() == *std::ranges::max_element(late_ns));
  RC_ASSERT(late->lost == 0U);
}

RC_GTEST_PROP(StampLateness, DoesNotKnowTheOrderOfThePulsesNorTheTimeOfDay, ()) {
  auto late_ns = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-20'000, 100'000));
  const auto one = stampLateness(pulsesOf(late_ns), lines());
  std::ranges::reverse(late_ns);
  const auto other = stampLateness(pulsesOf(late_ns), lines());
  RC_ASSERT(one.ok() == other.ok());
  if (!one) return;
  RC_ASSERT(one->median == other->median);
  RC_ASSERT(one->p99 == other->p99);
  RC_ASSERT(one->sigma == other->sigma);
}

TEST(StampLateness, IsRefusedWhenMoreThanHalfIsLostAndNamesTheJumper) {
  EXPECT_TRUE(stampLateness(pulsesOf({5, -1}), lines()));
  const auto refused = stampLateness(pulsesOf({5, -1, -1}), lines());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what,
              AllOf(HasSubstr("2 of 3"), HasSubstr("gpiochip7 line 0"), HasSubstr("gpiochip7 line 1")));
  EXPECT_FALSE(stampLateness({}, lines()));
}

TEST(EmulatedLoopBack, StampsAsLateAsItIsTold) {
  int number = 0;
  EmulatedLoopBack wire{[&]() -> std::optional<Nanoseconds> {
    if (++number % 4 == 0) return std::nullopt;
    return microseconds{20};
  }};
  const auto pulses = wire.measure(40);
  ASSERT_TRUE(pulses);
  const auto late = stampLateness(*pulses, lines());
  ASSERT_TRUE(late);
  EXPECT_EQ(late->pulses, 40U);
  EXPECT_EQ(late->lost, 10U);
  EXPECT_EQ(late->median, microseconds{20} + late->bracket / 2) << "the edge is in the middle of the write";
  EXPECT_EQ(late->sigma, Nanoseconds{});
}

class LoopBackOnAChip : public ::testing::Test {
 protected:
  void SetUp() override { plug({{"OUT", false, ""}, {"BACK", false, ""}}); }
  void plug(std::vector<MockChip::Line> with) {
    chip_.reset();
    chip_ = makeMockChip(std::move(with));
    if (!chip_) GTEST_SKIP() << "the real gpio driver is not tested: install libumockdev-dev and configure again";
  }
  static std::vector<LoopBackPulse> measured(std::size_t pulses, const board::LoopBack& on = lines()) {
    const auto all = LinuxLoopBack{on, {}}.measure(pulses);
    EXPECT_TRUE(all) << all.error().what;
    return all ? *all : std::vector<LoopBackPulse>{};
  }
  static std::string refusal(const board::LoopBack& on, const std::vector<ChipLines>& watched = {}) {
    const auto refused = LinuxLoopBack{on, watched}.measure(10);
    EXPECT_FALSE(refused);
    return refused ? "" : refused.error().what;
  }

  std::unique_ptr<MockChip> chip_;
};

TEST_F(LoopBackOnAChip, BracketsTheWriteAndTakesTheKernelsStamp) {
  constexpr Nanoseconds kLate = microseconds{700};
  chip_->join([=] { return kLate.count(); });
  const auto pulses = measured(20);
  ASSERT_EQ(pulses.size(), 20U);
  Nanoseconds longest_write{};
  for (const auto& [before, after, stamp] : pulses) {
    longest_write = std::max(longest_write, Nanoseconds{after - before});
    ASSERT_TRUE(stamp);
    EXPECT_GE(*stamp, before + kLate);
    EXPECT_LE(*stamp, after + kLate);
  }
  EXPECT_EQ(chip_->risesDriven(), 20);
  const auto late = stampLateness(pulses, lines());
  ASSERT_TRUE(late);
  EXPECT_GE(late->median, kLate);
  EXPECT_LE(late->median, late->largest);
  EXPECT_LE(late->largest, kLate + longest_write);
}

TEST_F(LoopBackOnAChip, ReadsAWireThatTurnsTheLevelOver) {
  chip_->join([] { return 1000; });
  auto inverted = lines();
  inverted.output.active = ActiveLevel::low;
  inverted.input.active = ActiveLevel::low;
  for (const auto& pulse : measured(5, inverted)) EXPECT_TRUE(pulse.stamp);
  EXPECT_EQ(chip_->risesDriven(), 5) << "after each pulse back to rest";
}

TEST_F(LoopBackOnAChip, CountsAnEdgeThatNeverCameAndGoesOn) {
  int number = 0;
  chip_->join([&]() -> std::optional<std::int64_t> {
    if (number++ % 3 == 1) return std::nullopt;
    return 1000;
  });
  const auto pulses = measured(12);
  ASSERT_EQ(pulses.size(), 12U);
  for (std::size_t i = 0; i < pulses.size(); ++i) EXPECT_EQ(pulses[i].stamp.has_value(), i % 3 != 1) << i;
}

TEST_F(LoopBackOnAChip, TakesNoEdgeThatIsOlderThanTheWrite) {
  chip_->join([] { return -1'000'000'000; });
  for (const auto& pulse : measured(3)) EXPECT_FALSE(pulse.stamp);
}

TEST_F(LoopBackOnAChip, GivesUpWhereNothingComesBack) {
  const auto pulses = measured(2000);
  EXPECT_EQ(pulses.size(), 25U);
  EXPECT_FALSE(stampLateness(pulses, lines()));
}

// box.toml cannot know that two names are one line.
TEST_F(LoopBackOnAChip, NeverDrivesWhatTheBoxWatchesUnderAnotherName) {
  const auto watched = [](const char* chip, const board::LineAddress& line) {
    return std::vector<ChipLines>{{chip, {{"sync", line, {}}}}};
  };
  for (const auto* chip : {"gpiochip7", MockChip::kNode, MockChip::kLabel}) {
    EXPECT_THAT(refusal(lines(), watched(chip, "OUT")), testing::AllOf(HasSubstr("line 0"), HasSubstr("'sync'")));
    EXPECT_THAT(refusal(lines(), watched(chip, 1U)), testing::AllOf(HasSubstr("loop-back"), HasSubstr("'sync'")));
  }
  auto same = lines();
  same.input.line = "OUT";
  EXPECT_THAT(refusal(same), testing::AllOf(HasSubstr("loop-back"), HasSubstr("'loop-back input'")));
  EXPECT_EQ(chip_->risesDriven(), 0);
  // One that is not there is nobody's.
  chip_->join([] { return 1000; });
  const auto good = LinuxLoopBack{lines(), watched("gpiochip9", 0U)}.measure(3);
  EXPECT_TRUE(good && good->size() == 3U);
}

TEST_F(LoopBackOnAChip, NamesWhatCannotBeHad) {
  auto elsewhere = lines();
  elsewhere.input.chip = "gpiochip9";
  EXPECT_THAT(refusal(elsewhere), testing::AllOf(HasSubstr("gpiochip9"), HasSubstr("no such")));
  EXPECT_THAT(refusal(lines(5, 1)), testing::AllOf(HasSubstr("gpiochip7"), HasSubstr("line 5")));
  plug({{"OUT", false, ""}, {"BACK", false, "spindle-monitor"}});
  EXPECT_THAT(refusal(lines()), AllOf(HasSubstr("line 1"), HasSubstr("'spindle-monitor'"), HasSubstr("another line")));
}

}  // namespace
}  // namespace probebox::gpio
