#pragma once
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/support/runs.hpp"

namespace probebox::scenario {

// Errors in the unit of the standard deviation that was stated with each.
class Pulls {
 public:
  // For what two sets of noise gave 0.4 to 0.7 for: an sd about 1.4 times too large.
  static constexpr double kCautious = 0.5;

  // Errors of one run share its noise: more are not taken for independent.
  static constexpr int kIndependent = 24;

  void add(double value, double truth, double sd) {
    ASSERT_GT(sd, 0);
    const double pull = (value - truth) / sd;
    EXPECT_LT(std::abs(pull), 4) << value << " +/- " << sd << ", truth " << truth;
    squares_ += pull * pull;
    ++count_;
  }
  // Limits of the mean square of so many independent errors (Wilson and Hilferty's approximation of chi-square): twice
  // the standard deviation of its cube root, and three times it where a test sees a quarter of its runs, whose
  // errors are not all independent; the seeds are fixed. least: smaller than 1 where the stated sd is known to be too
  // large.
  void expectHonest(double least = 1) const {
    ASSERT_GE(count_, 8);
    const double variance = 2.0 / (9.0 * std::min(count_, kIndependent)),
                 width = (runsAreComplete() ? 2 : 3) * std::sqrt(variance);
    EXPECT_GT(squares_ / count_, least * std::pow(1 - variance - width, 3));
    EXPECT_LT(squares_ / count_, std::pow(1 - variance + width, 3));
    ::testing::Test::RecordProperty("mean_square", std::to_string(squares_ / count_));
  }

 private:
  double squares_{};
  int count_{};
};

}  // namespace probebox::scenario
