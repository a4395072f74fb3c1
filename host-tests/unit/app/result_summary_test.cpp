#include "firmware/app/result_summary.hpp"

#include <gtest/gtest.h>

namespace probebox::app {
namespace {

TEST(StatusOfTheBox, NamesEverythingThatReachedTheCoreForNothing) {
  box::State state;
  state.latch.late = 1;
  state.latch.disordered = 2;
  state.latch.overwritten = 3;
  state.incomplete_rows = 4;
  state.stray_markers = 5;
  const auto unused = unusedEvents(state);
  EXPECT_EQ(unused.late, 1U);
  EXPECT_EQ(unused.disordered, 2U);
  EXPECT_EQ(unused.overwritten, 3U);
  EXPECT_EQ(unused.incomplete_rows, 4U);
  EXPECT_EQ(unused.stray_markers, 5U);
}

}  // namespace
}  // namespace probebox::app
