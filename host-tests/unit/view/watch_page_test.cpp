#include "tools/probebox/screen/watch_page.hpp"

#include <algorithm>
#include <gtest/gtest.h>

#include "tools/probebox/screen/machine_page.hpp"

namespace probebox::command {
namespace {

constexpr const char* kPrompt =
    "move the stylus in front of the datum sphere, normal X -0.7071 Y 0.7071 Z 0.0000, then touch it at 12.5 mm/s with "
    "0.3 mm "
    "of overtravel and hold still until the box says so";

std::size_t widthOf(const std::string& text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

// With the longest that every row may have to say.
WatchState full() {
  WatchState state;
  state.descriptor.board = "sim";
  state.descriptor.serial_number = "SIM-0001";
  state.descriptor.machine = "mill";
  state.descriptor.probe = "probe";
  for (const auto* name : {"deflection_a", "deflection_b", "deflection_c"})
    state.channels.push_back({name, "nm", -123456, {}});
  for (const auto* name : {"position_x", "position_y", "position_z"})
    state.channels.push_back({name, "mm", -9999.1234, {}});
  state.beat.emplace();
  state.beat->clock_state = ClockState::locked;
  state.beat->clock_sigma_ns = 123456;
  state.restarts = 12;
  state.balanced = false;
  auto& trigger = state.trigger.emplace();
  trigger.number = 123456;
  trigger.has_position = 7;
  trigger.position_mm = {-9999.1234, -9999.1234, -9999.1234};
  state.corrections.emplace();
  state.corrections->degraded = true;
  state.status.emplace();
  state.status->inhibits.push_back(
      {"tcp:127.0.0.1:12345", "Bartholomaeus-Maximilian Wolfeschlegelstein", "2026-11-30T12:00:00Z"});
  auto& procedure = state.procedure.emplace();
  procedure.state = RunState::running;
  procedure.method = "delay-multi-speed";
  procedure.steps = 25;
  procedure.prompt = kPrompt;
  state.verdict.may_cut = MayCut::check;
  state.verdict.reason =
      "Rotary axis C is not proven to be within its limit: deviation XC at 60 deg -6.8 +/- 0.6 um, limit 8 um.";
  auto& tile = state.verdict.tiles.emplace_back();
  tile.title = "Rotary axis C";
  tile.id = 12;
  tile.remarks.push_back(kPrompt);
  tile.accepted_by = "Bartholomaeus-Maximilian Wolfeschlegelsteinhausenbergerdorff";
  tile.accepted_utc = "2026-11-28T12:05:00Z";
  tile.decisive =
      DecisiveValue{.name = "deviation", .unit = "um", .value = -6.8, .text = "deviation XC at 60 deg -6.8 +/- 0.6 um"};
  return state;
}

void expectInside(const std::vector<Span>& page, ScreenSize size) {
  EXPECT_FALSE(page.empty());
  for (const auto& span : page) {
    EXPECT_LT(span.row, size.rows) << span.text;
    EXPECT_LE(span.column + widthOf(span.text), size.columns) << "cut: " << span.text;
  }
}

bool shows(const std::vector<Span>& page, std::string_view text) {
  return std::ranges::any_of(page, [&](const Span& span) { return span.text.find(text) != std::string::npos; });
}

TEST(WatchPage, CutsNothingAtAnySize) {
  for (const ScreenSize size : {ScreenSize{24, 80}, {25, 81}, {40, 120}, {50, 150}, {50, 200}, {70, 300}}) {
    auto state = full();
    expectInside(watchPage(state, size, true), size);
    state.machine_page = true;
    expectInside(watchPage(state, size, true), size);
  }
}

TEST(WatchPage, HasTheWholePromptWhereTwoRowsHoldIt) {
  auto state = full();
  state.procedure->prompt =
      "touch the datum sphere from +X at 12.5 mm/s with 0.3 mm of overtravel and hold still until it is told";
  const auto page = watchPage(state, {24, 80}, true);
  std::string both;
  for (const auto& span : page)
    if (span.row == 21 || span.row == 22) both += (both.empty() ? "" : " ") + span.text;
  EXPECT_EQ(both, state.procedure->prompt);
}

TEST(WatchPage, HasTheMachineByItsKeyOrBesideTheLivePage) {
  auto state = full();
  EXPECT_FALSE(shows(watchPage(state, {24, 80}, true), "Rotary axis C -") ||
               shows(watchPage(state, {24, 80}, true), "[!!] CHECK"));
  EXPECT_TRUE(shows(watchPage(state, {24, 80}, true), "Check")) << "the word stands on the live page too";
  state.machine_page = true;
  EXPECT_TRUE(shows(watchPage(state, {24, 80}, true), "[!!] CHECK"));
  state.machine_page = false;
  const auto both = watchPage(state, {50, 200}, true);
  EXPECT_TRUE(shows(both, "[!!] CHECK"));
  EXPECT_TRUE(shows(both, "sigma"));
}

// The answer of a moment that is over never stands alone as if it were of now.
TEST(WatchPage, TheMachinePageSaysThatItIsHeldOrWithoutALink) {
  for (const ScreenSize size : {ScreenSize{24, 80}, ScreenSize{50, 200}}) {
    auto state = full();
    state.machine_page = true;
    EXPECT_TRUE(shows(watchPage(state, size, true), " LIVE "));
    state.held = true;
    EXPECT_TRUE(shows(watchPage(state, size, true), " HELD "));
    state.link_up = false;
    EXPECT_TRUE(shows(watchPage(state, size, true), " LINK LOST "));
  }
}

// A terminal obeys what a box sends unless it is made harmless.
TEST(WatchPage, NoTextOfTheBoxReachesTheTerminalAsAnOrder) {
  const std::string order = "\x1b[2J\n\t";
  auto state = full();
  state.machine_page = true;
  state.verdict.reason += order;
  state.verdict.cut = order;
  state.verdict.more.push_back(order);
  auto& tile = state.verdict.tiles.front();
  tile.title += order;
  tile.decisive->text = order + tile.decisive->text;
  tile.accepted_by = order;
  tile.accepted_utc = "2026-11-28\x1b[2J";
  tile.remarks = {order};
  for (const double number : {1.0, 2.0}) tile.trend.points.push_back({.value = number});
  const auto page = watchPage(state, {40, 120}, true);
  for (const auto& span : page)
    EXPECT_FALSE(std::ranges::any_of(span.text, [](unsigned char c) { return c < 0x20; })) << span.text;
  EXPECT_TRUE(shows(page, "▁█")) << "the trend has its blocks";
}

TEST(Wrapped, KeepsWordsWhole) {
  EXPECT_EQ(wrapped("one two three", 7, 9), (std::vector<std::string>{"one two", "three"}));
  EXPECT_EQ(wrapped("one two three four", 11, 1), (std::vector<std::string>{"one two ..."}));
  EXPECT_EQ(shortened("x 1.2345", 80), "x 1.2345");
  EXPECT_EQ(shortened("value 123456.789 mm", 15), "value ...");
  EXPECT_TRUE(wrapped("", 10, 3).empty());
}

}  // namespace
}  // namespace probebox::command
