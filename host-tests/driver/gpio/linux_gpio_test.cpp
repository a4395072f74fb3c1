#include "drivers/gpio/linux_gpio.hpp"

#include <array>
#include <cerrno>
#include <gmock/gmock.h>
#include <optional>

#include "mock_chip.hpp"

namespace probebox::gpio {
namespace {

using board::ActiveLevel;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr MonoTime kNow = monoTime(9'000'000'000);

ChipLines boxLines(const std::string& chip = "gpiochip7") {
  return {chip,
          {{"sync", 2U, {0, LineRole::sync, 0, ActiveLevel::high, Edges::active}},
           {"probe", std::string{"TOUCH"}, {0, LineRole::trigger, 0, ActiveLevel::low, Edges::both}},
           {"skip", 0U, {0, LineRole::skip, 1, ActiveLevel::high, Edges::both}}}};
}

// What the kernel will do for the line that was asked for at this offset.
std::optional<std::uint64_t> flagsOf(const gpio_v2_line_request& request, unsigned offset) {
  for (unsigned i = 0; i < request.num_lines; ++i) {
    if (request.offsets[i] != offset) continue;
    for (unsigned a = 0; a < request.config.num_attrs; ++a) {
      const auto& [attribute, mask] = request.config.attrs[a];
      if (attribute.id == GPIO_V2_LINE_ATTR_ID_FLAGS && (mask >> i & 1U) != 0) return attribute.flags;
    }
    return request.config.flags;
  }
  return std::nullopt;
}

class LinuxGpioOnAChip : public ::testing::Test {
 protected:
  void SetUp() override { plug({{"SKIP", false, ""}, {"TOUCH", true, ""}, {"SYNC", false, ""}}); }

  void plug(std::vector<MockChip::Line> lines) {
    chip_.reset();
    chip_ = makeMockChip(std::move(lines));
    if (!chip_) GTEST_SKIP() << "the real gpio driver is not tested: install libumockdev-dev and configure again";
  }

  void open(const ChipLines& lines = boxLines()) {
    source_ = std::make_unique<LinuxGpio>(lines);
    const auto acquired = source_->acquire();
    ASSERT_TRUE(acquired.ok()) << acquired.error().what;
  }

  std::vector<Event> read(MonoTime now = kNow, std::size_t room = 256) {
    std::vector<Event> events(room);
    events.resize(source_->read(events, now));
    return events;
  }

  std::unique_ptr<MockChip> chip_;
  std::unique_ptr<LinuxGpio> source_;  // lets its lines go before the chip does
};

TEST_F(LinuxGpioOnAChip, AsksForLinesByOffsetAndByNameStampedOnTheMonotonicClock) {
  open();
  const auto request = chip_->request();
  EXPECT_EQ(request.num_lines, 3U);
  EXPECT_STREQ(request.consumer, "probeboxd");
  EXPECT_EQ(request.event_buffer_size, 1024U);
  constexpr auto kInput = GPIO_V2_LINE_FLAG_INPUT;
  // No EVENT_CLOCK flag is the monotonic clock; any other flag would show here too.
  EXPECT_EQ(flagsOf(request, 2), kInput | GPIO_V2_LINE_FLAG_EDGE_RISING);
  for (const unsigned both : {0U, 1U}) {
    EXPECT_EQ(flagsOf(request, both), kInput | GPIO_V2_LINE_FLAG_EDGE_RISING | GPIO_V2_LINE_FLAG_EDGE_FALLING);
  }
}

TEST_F(LinuxGpioOnAChip, IsFoundByPathAndByLabel) {
  for (const char* const name : {MockChip::kNode, MockChip::kLabel}) {
    SCOPED_TRACE(name);
    open(boxLines(name));
    EXPECT_GE(source_->descriptor(), 0);
  }
}

TEST_F(LinuxGpioOnAChip, TellsEdgesWithTheKernelsStampsAndKeepsGapsInTheSequence) {
  open();
  read();
  chip_->tell(2, true, 5'000'000'001, 1);
  chip_->tell(1, false, 5'000'000'002, 1);
  chip_->tell(1, true, 5'000'000'003, 2);
  chip_->tell(2, true, 5'000'000'004, 5);
  const auto events = read();
  ASSERT_EQ(events.size(), 4U);
  const std::array expected{Edge{LineRole::sync, 0, Level::active, 1, monoTime(5'000'000'001)},
                            Edge{LineRole::trigger, 0, Level::active, 1, monoTime(5'000'000'002)},
                            Edge{LineRole::trigger, 0, Level::inactive, 2, monoTime(5'000'000'003)},
                            Edge{LineRole::sync, 0, Level::active, 5, monoTime(5'000'000'004)}};
  for (std::size_t i = 0; i < events.size(); ++i) {
    SCOPED_TRACE(i);
    const auto& edge = std::get<Edge>(events[i]);
    EXPECT_EQ(edge.role, expected[i].role);
    EXPECT_EQ(edge.level, expected[i].level);
    EXPECT_EQ(edge.line_sequence, expected[i].line_sequence);
    EXPECT_EQ(edge.at, expected[i].at);
  }
  EXPECT_TRUE(read().empty());
  EXPECT_FALSE(source_->lost()) << "nothing to read is no loss";
}

TEST_F(LinuxGpioOnAChip, LeavesInTheKernelWhatTheReaderHasNoRoomFor) {
  open();
  read();
  for (std::uint32_t i = 1; i <= 5; ++i) chip_->tell(2, true, i, i);
  EXPECT_EQ(read(kNow, 2).size(), 2U);
  const auto rest = read();
  ASSERT_EQ(rest.size(), 3U);
  EXPECT_EQ(std::get<Edge>(rest[0]).line_sequence, 3U);
}

TEST_F(LinuxGpioOnAChip, TellsThePresentLevelsOfLinesWatchedOnBothEdgesOnce) {
  chip_->setLevel(1, false);  // active low: the probe is in contact
  chip_->setLevel(2, true);   // a sync line is watched on one edge and has no level to tell
  open();
  const auto events = read();
  ASSERT_EQ(events.size(), 2U);
  const auto& touch = std::get<Edge>(events[0]);
  EXPECT_EQ(touch.role, LineRole::trigger);
  EXPECT_EQ(touch.level, Level::active);
  EXPECT_EQ(touch.line_sequence, 0U);
  EXPECT_EQ(touch.at, kNow);
  const auto& skip = std::get<Edge>(events[1]);
  EXPECT_EQ(skip.role, LineRole::skip);
  EXPECT_EQ(skip.line, 1);
  EXPECT_EQ(skip.level, Level::inactive);
  EXPECT_TRUE(read().empty());
}

TEST_F(LinuxGpioOnAChip, StampsAPresentLevelNoLaterThanTheFirstEdgeThatFollowsIt) {
  open();
  chip_->tell(1, false, 5'000'000'000, 1);
  const auto events = read();
  ASSERT_EQ(events.size(), 3U);
  for (const auto& event : events) EXPECT_EQ(stampOf(event), monoTime(5'000'000'000));
  EXPECT_EQ(std::get<Edge>(events[0]).level, Level::inactive);
  EXPECT_EQ(std::get<Edge>(events[2]).level, Level::active);
}

TEST_F(LinuxGpioOnAChip, NamesALineThatAnotherProcessHoldsAndTheRemedy) {
  plug({{"SKIP", false, ""}, {"TOUCH", true, "spindle-monitor"}, {"SYNC", false, ""}});
  LinuxGpio source{boxLines()};
  const auto refused = source.acquire();
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, AllOf(HasSubstr("gpiochip7"), HasSubstr("TOUCH"), HasSubstr("probe"),
                                          HasSubstr("'spindle-monitor'"), HasSubstr("another line")));
}

TEST_F(LinuxGpioOnAChip, NamesALineThatTheChipDoesNotHave) {
  auto by_name = boxLines();
  by_name.lines[1].address = std::string{"PROBE_9"};
  auto by_offset = boxLines();
  by_offset.lines[0].address = 3U;  // the chip has 0, 1 and 2
  const auto no_name = LinuxGpio{by_name}.acquire();
  ASSERT_FALSE(no_name.ok());
  EXPECT_THAT(no_name.error().what, AllOf(HasSubstr("\"PROBE_9\" (probe)"), HasSubstr("gpioinfo")));
  const auto no_offset = LinuxGpio{by_offset}.acquire();
  ASSERT_FALSE(no_offset.ok());
  EXPECT_THAT(no_offset.error().what, AllOf(HasSubstr("line 3 (sync)"), HasSubstr("gpioinfo")));
}

// 0: the descriptor gives the end of the file.
class LinuxGpioOnAVanishingChip : public LinuxGpioOnAChip, public ::testing::WithParamInterface<int> {};

TEST_P(LinuxGpioOnAVanishingChip, TellsTheLossOnceAndGoesOnAfterAcquiringThemAgain) {
  open();
  read();
  chip_->tell(1, false, 1, 1);
  chip_->tell(1, true, 2, 2);
  EXPECT_EQ(read().size(), 2U);

  chip_->unplug(GetParam());
  const auto lost = read();
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(std::get<SourceLost>(lost[0]).source, Source::sync);
  EXPECT_EQ(std::get<SourceLost>(lost[1]).source, Source::trigger);
  EXPECT_EQ(std::get<SourceLost>(lost[1]).reason, LossReason::disconnected);
  EXPECT_EQ(std::get<SourceLost>(lost[1]).at, kNow);
  EXPECT_TRUE(source_->lost());
  EXPECT_TRUE(read().empty());

  const auto away = source_->acquire();
  ASSERT_FALSE(away.ok());
  EXPECT_THAT(away.error().what, HasSubstr("gpio chip"));
  EXPECT_EQ(source_->descriptor(), -1);
  EXPECT_TRUE(read().empty()) << "a failed try is no second loss";

  chip_->plugIn();
  chip_->setLevel(1, false);
  ASSERT_TRUE(source_->acquire().ok());
  EXPECT_FALSE(source_->lost());
  const auto levels = read();
  ASSERT_EQ(levels.size(), 2U);
  EXPECT_EQ(std::get<Edge>(levels[0]).level, Level::active);
  EXPECT_EQ(std::get<Edge>(levels[0]).line_sequence, 2U) << "the last known one: no gap is claimed";
  chip_->tell(1, true, 3, 1);  // the kernel counts anew
  const auto back = read();
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(std::get<Edge>(back[0]).line_sequence, 3U);
}

TEST_P(LinuxGpioOnAVanishingChip, TellsALossBeforeTheLevelsFoundAfterIt) {
  open();
  read();
  chip_->unplug(GetParam());
  EXPECT_EQ(read(kNow, 1).size(), 1U);  // room for one of two notices
  chip_->plugIn();
  ASSERT_TRUE(source_->acquire().ok());
  const auto events = read();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<SourceLost>(events[0]));
  EXPECT_TRUE(std::holds_alternative<Edge>(events[1]));
}

INSTANTIATE_TEST_SUITE_P(EndOfFileOrError, LinuxGpioOnAVanishingChip, ::testing::Values(0, ENODEV));

}  // namespace
}  // namespace probebox::gpio
