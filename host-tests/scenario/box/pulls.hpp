#pragma once
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/support/runs.hpp"

namespace probebox::scenario {

// Errors in the unit of the standard deviation that was stated with each.
class Pulls {
 public:
  // Lower limit for what two sets of noise gave 0.4 to 0.7 for: an sd about 1.4 times too large.
  static constexpr double kCautious = 0.35;

  void add(double value, double truth, double sd) {
    ASSERT_GT(sd, 0);
    const double pull = (value - truth) / sd;
    EXPECT_LT(std::abs(pull), 4) << value << " +/- " << sd << ", truth " << truth;
    squares_ += pull * pull;
    ++count_;
  }
  // The mean square of 20 and more independent errors leaves 0.5 to 1.6 about once in twenty; the seeds are fixed. A
  // third of the runs has wider limits. least: smaller where the stated sd is known to be too large.
  void expectHonest(double least = 0.5) const {
    ASSERT_GE(count_, 8);
    EXPECT_GT(squares_ / count_, runsAreComplete() ? least : std::min(least, kCautious));
    EXPECT_LT(squares_ / count_, runsAreComplete() ? 1.6 : 2.1);
    ::testing::Test::RecordProperty("mean_square", std::to_string(squares_ / count_));
  }

 private:
  double squares_{};
  int count_{};
};

}  // namespace probebox::scenario
