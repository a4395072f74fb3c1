#include "firmware/capture/common_stamps.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

// Axes that are read one by one, brought to common stamps.
namespace probebox::capture {
namespace {

using namespace std::chrono_literals;

// 20 mm/s in nm, along all axes.
std::int64_t countsAt(std::size_t axis, MonoTime at) {
  return std::llround(static_cast<double>(axis + 1) * 0.02 * static_cast<double>(toNs(at)));
}

class Stamps : public ::testing::Test {
 protected:
  void push(std::size_t axis, Nanoseconds at, std::optional<std::int32_t> screw_nm = 0) {
    const MonoTime stamp = monoTime(at.count());
    stamps.push({static_cast<Axis>(axis), 0, countsAt(axis, stamp), stamp}, screw_nm);
    while (const auto row = stamps.next()) rows.push_back(*row);
  }

  CommonStamps stamps{{1ms, 1ms, 1ms}};
  std::vector<CommonStamps::Row> rows;
};

TEST_F(Stamps, OfAxesThatAreReadOneAfterTheOtherAreThoseOfOneOfThem) {
  for (int i = 0; i < 100; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) push(axis, i * 1ms + static_cast<int>(axis) * 37us);
  ASSERT_EQ(rows.size(), 99U) << "the last one waits";
  for (const auto& row : rows)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(static_cast<double>(row.counts[axis]), static_cast<double>(countsAt(axis, row.at)), 1);
  EXPECT_EQ(stamps.incomplete(), 0U);
}

TEST_F(Stamps, OfAxesThatAreLatchedTogetherLoseNothing) {
  for (int i = 0; i < 10; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) push(axis, i * 1ms);
  ASSERT_EQ(rows.size(), 10U);
  EXPECT_EQ(rows[9].counts[2], countsAt(2, rows[9].at));
}

// No row is made that was not measured.
TEST_F(Stamps, AreThoseOfTheSlowestAxis) {
  stamps = CommonStamps{{1ms, 10ms, 100us}};
  for (int i = 0; i < 1000; ++i) {
    push(2, i * 100us);
    if (i % 10 == 3) push(0, i * 100us + 20us);
    if (i % 100 == 50) push(1, i * 100us + 50us);
  }
  ASSERT_EQ(rows.size(), 10U);
  for (const auto& row : rows)
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(static_cast<double>(row.counts[axis]), static_cast<double>(countsAt(axis, row.at)), 1);
}

TEST_F(Stamps, AreNotGuessedOverAGap) {
  for (int i = 0; i < 100; ++i) {
    push(0, i * 1ms);
    if (i < 40 || i >= 45) push(1, i * 1ms + 100us);
    push(2, i * 1ms + 200us);
  }
  EXPECT_EQ(stamps.incomplete(), 6U);
  EXPECT_EQ(rows.size(), 99U - 6U);
  for (const auto& row : rows)
    EXPECT_NEAR(static_cast<double>(row.counts[1]), static_cast<double>(countsAt(1, row.at)), 1);
}

TEST_F(Stamps, FollowACountThatWrapsAround) {
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
  stamps = CommonStamps{{1ms, 0ms, 1ms}};
  stamps.push({Axis::x, 0, kLast - 9, monoTime(0)}, 0);
  stamps.push({Axis::z, 0, 0, monoTime(500'000)}, 0);
  stamps.push({Axis::x, 1, kFirst + 10, monoTime(1'000'000)}, 0);
  const auto row = stamps.next();
  ASSERT_TRUE(row);
  EXPECT_EQ(row->counts[0], kFirst) << "half of the way of 20 counts";
}

TEST_F(Stamps, DoNotWaitForAnAxisWithoutAnEncoder) {
  stamps = CommonStamps{{1ms, 0ms, 1ms}};
  push(0, 0ms);
  push(2, 10us);
  push(0, 1ms);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].counts[1], 0);
  EXPECT_EQ(rows[0].screw_nm[1], 0);
}

TEST_F(Stamps, KeepTheExpansionOfEachScrewAndThatItIsNotKnown) {
  push(0, 0ms, 11);
  push(1, 0ms, std::nullopt);
  push(2, 0ms, 33);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].screw_nm[0], 11);
  EXPECT_FALSE(rows[0].screw_nm[1]);
  EXPECT_EQ(rows[0].screw_nm[2], 33);
}

// A read that comes late, behind a later one of its axis.
TEST_F(Stamps, TakeNoCountThatIsNotLaterThanTheLastOne) {
  for (int i = 0; i < 10; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      push(axis, i * 1ms);
      stamps.push({static_cast<Axis>(axis), 0, -1, monoTime(Nanoseconds{i * 1ms - 500us}.count())}, 0);
      stamps.push({static_cast<Axis>(axis), 0, -1, monoTime(Nanoseconds{i * 1ms}.count())}, 0);
    }
  }
  ASSERT_EQ(rows.size(), 10U);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(toNs(rows[i].at), static_cast<std::int64_t>(i) * 1'000'000);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(rows[i].counts[axis], countsAt(axis, rows[i].at));
  }
  EXPECT_EQ(stamps.incomplete(), 0U);
}

}  // namespace
}  // namespace probebox::capture
