#include "firmware/app/log/log.hpp"

#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

TEST(LimitedWarning, SaysTheFirstAtOnceAndCountsWhatItLeavesOut) {
  std::vector<std::string> said;
  LimitedWarning warning{10s, [&](std::string_view text) { said.emplace_back(text); }};
  const auto start = monoTime(5'000'000'000);
  warning.look(start);
  for (int k = 0; k < 1000; ++k) warning.warn(start + k * 1ms, "refused " + std::to_string(k));
  EXPECT_THAT(said, ElementsAre("refused 0"));
  warning.look(start + 10s - 1ns);
  EXPECT_EQ(said.size(), 1U);
  warning.look(start + 10s);
  warning.look(start + 60s);
  EXPECT_THAT(said, ElementsAre("refused 0", "refused 999 (999 lines like this since the last one)"));
  warning.warn(start + 61s, "refused again");
  EXPECT_EQ(said.back(), "refused again") << "quiet for long enough";
}

TEST(LimitedWarning, SaysNoMoreThanOneLineInAPauseHoweverLongItLasts) {
  std::vector<std::string> said;
  LimitedWarning warning{10s, [&](std::string_view text) { said.emplace_back(text); }};
  for (int k = 0; k < 36'000; ++k) warning.warn(monoTime(1) + k * 100ms, "x");
  EXPECT_LE(said.size(), 361U);
  EXPECT_GE(said.size(), 359U);
}

}  // namespace
}  // namespace probebox::app
