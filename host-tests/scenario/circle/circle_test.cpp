#include "circle.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <iterator>
#include <map>

#include "host-tests/support/runs.hpp"

// A controller alone measures, corrects and measures again, on machines whose errors nobody knows.
namespace probebox::scenario {
namespace {

// Of the squares of values in their sd.
struct Sum {
  double squares{};
  int count{};

  void add(const Residual& residual) {
    squares += residual.value * residual.value / (residual.sd * residual.sd);
    ++count;
  }
  double mean() const { return squares / count; }
};

TEST(CircleOfTheController, LeavesWhatTheStandardDeviationsOfBothMeasurementsSay) {
  Sum all;
  const std::uint64_t worlds = runsAreComplete() ? 2 : 1;
  for (std::uint64_t seed = 1; seed <= worlds; ++seed) {
    SCOPED_TRACE(seed);
    Circle circle{seed};
    circle.calibrateAll();
    ASSERT_FALSE(HasFatalFailure());
    auto left = circle.delayAgain();
    std::ranges::move(circle.corrected(), std::back_inserter(left));
    EXPECT_EQ(circle.crashes(), 0U);
    ASSERT_EQ(left.size(), 14U);
    for (const auto& residual : left) {
      ASSERT_GT(residual.sd, 0);
      EXPECT_LE(std::abs(residual.value), 3 * residual.sd) << residual.of;
      all.add(residual);
    }
  }
  // Chi-square of 28, or of 14: 0.1 % below and above.
  EXPECT_GE(all.squares, runsAreComplete() ? 10.4 : 3.0);
  EXPECT_LE(all.squares, runsAreComplete() ? 56.9 : 36.1);
}

TEST(CircleOfTheController, FindsTheSameErrorsManyStandardDeviationsLargeWithoutTheCorrection) {
  Circle circle{1};
  circle.calibrateAll();
  ASSERT_FALSE(HasFatalFailure());
  std::map<std::string_view, Sum> with, without;
  for (const auto& residual : circle.corrected()) with[residual.of].add(residual);
  for (const auto& residual : circle.uncorrected()) without[residual.of].add(residual);
  ASSERT_EQ(without.size(), 4U);
  for (const auto& [of, sum] : without) {
    EXPECT_GE(sum.mean(), 100) << of;
    EXPECT_LE(with.at(of).mean(), 9) << of;
  }
}

}  // namespace
}  // namespace probebox::scenario
