#pragma once
#include <cmath>
#include <gtest/gtest.h>

namespace probebox::scenario {

// Errors in the unit of the standard deviation that was stated with each.
class Pulls {
 public:
  void add(double value, double truth, double sd) {
    ASSERT_GT(sd, 0);
    const double pull = (value - truth) / sd;
    EXPECT_LT(std::abs(pull), 4) << value << " +/- " << sd << ", truth " << truth;
    squares_ += pull * pull;
    ++count_;
  }
  // Of 20 and more independent errors the mean square leaves these limits about once in twenty; the seeds are fixed.
  void expectHonest() const {
    ASSERT_GE(count_, 20);
    EXPECT_GT(squares_ / count_, 0.5);
    EXPECT_LT(squares_ / count_, 1.6);
    ::testing::Test::RecordProperty("mean_square", std::to_string(squares_ / count_));
  }

 private:
  double squares_{};
  int count_{};
};

}  // namespace probebox::scenario
