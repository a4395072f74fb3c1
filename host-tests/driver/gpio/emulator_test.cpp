#include "drivers/gpio/emulator.hpp"

#include <array>
#include <deque>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "drivers/gpio/linux_gpio.hpp"

namespace probebox::gpio {
namespace {

using board::ActiveLevel;

ChipLines syncAndTrigger() {
  return {"gpiochip0",
          {{"sync", 4U, {0, LineRole::sync, 0, ActiveLevel::high, Edges::active}},
           {"trigger", 5U, {0, LineRole::trigger, 0, ActiveLevel::low, Edges::both}}}};
}

std::vector<Event> readAll(EmulatedGpio& chip, MonoTime now) {
  std::array<Event, 4096> events;
  return {events.begin(), events.begin() + static_cast<std::ptrdiff_t>(chip.read(events, now))};
}

TEST(EmulatedGpio, TellsEdgesWhenTheirTimeHasCome) {
  EmulatedGpio chip{syncAndTrigger()};
  chip.drive(4, true, monoTime(100));
  chip.drive(4, true, monoTime(150));   // no change, no edge
  chip.drive(4, false, monoTime(200));  // not asked for
  chip.drive(5, false, monoTime(300));
  EXPECT_TRUE(readAll(chip, monoTime(99)).empty());
  const auto early = readAll(chip, monoTime(299));
  ASSERT_EQ(early.size(), 1U);
  EXPECT_EQ(std::get<Edge>(early[0]).at, monoTime(100));
  const auto late = readAll(chip, monoTime(300));
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(std::get<Edge>(late[0]).role, LineRole::trigger);
  EXPECT_EQ(std::get<Edge>(late[0]).level, Level::active);
}

// Against a second, slow model: what is lost at overflow is exactly what the sequence numbers leave out.
RC_GTEST_PROP(EmulatedGpio, LosesTheOldestWithAGapInTheSequence, (std::vector<bool> touches)) {
  constexpr std::size_t kQueue = 8;
  EmulatedGpio chip{syncAndTrigger(), kQueue};
  std::deque<std::uint32_t> model;
  std::uint32_t edges = 0;
  bool level = true;
  for (const bool next : touches) {
    if (next != level) {
      model.push_back(++edges);
      if (model.size() > kQueue) model.pop_front();
    }
    level = next;
    chip.drive(5, next, monoTime(edges));
  }
  const auto events = readAll(chip, monoTime(1'000'000));
  RC_ASSERT(events.size() == model.size());
  RC_ASSERT(chip.lostEdges() == edges - model.size());
  for (std::size_t i = 0; i < events.size(); ++i) RC_ASSERT(std::get<Edge>(events[i]).line_sequence == model[i]);
}

TEST(EmulatedGpio, SaysOnceForEachSourceThatTheChipHasGone) {
  EmulatedGpio chip{syncAndTrigger()};
  chip.drive(4, true, monoTime(1));
  EXPECT_EQ(readAll(chip, monoTime(1)).size(), 1U);
  chip.disconnect();
  chip.drive(4, false, monoTime(2));
  chip.drive(4, true, monoTime(3));
  const auto events = readAll(chip, monoTime(10));
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(std::get<SourceLost>(events[0]).source, Source::sync);
  EXPECT_EQ(std::get<SourceLost>(events[1]).source, Source::trigger);
  EXPECT_EQ(std::get<SourceLost>(events[1]).reason, LossReason::disconnected);
  EXPECT_TRUE(readAll(chip, monoTime(11)).empty());

  chip.reconnect();
  chip.drive(4, false, monoTime(12));
  chip.drive(4, true, monoTime(13));
  const auto back = readAll(chip, monoTime(13));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(std::get<Edge>(back[0]).line_sequence, 2U);
}

TEST(LinuxGpio, NamesAChipThatIsNotThere) {
  auto lines = syncAndTrigger();
  lines.chip = "no-such-chip";
  const auto acquired = LinuxGpio{lines}.acquire();
  ASSERT_FALSE(acquired.ok());
  EXPECT_THAT(acquired.error().what,
              ::testing::AllOf(::testing::HasSubstr("no-such-chip"), ::testing::HasSubstr("gpiodetect")));
}

TEST(LinuxGpio, RefusesADeviceThatIsNoGpioChip) {
  auto lines = syncAndTrigger();
  lines.chip = "/dev/null";
  const auto acquired = LinuxGpio{lines}.acquire();
  ASSERT_FALSE(acquired.ok());
  EXPECT_THAT(acquired.error().what, ::testing::HasSubstr("gpiodetect"));
}

}  // namespace
}  // namespace probebox::gpio
