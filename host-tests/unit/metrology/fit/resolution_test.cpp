#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "firmware/metrology/fit/line.hpp"

namespace probebox::metrology {
namespace {

// Readings of an encoder of this step, in the order in which a noisy axis passes them.
std::vector<double> readings(double step_mm, std::initializer_list<int> steps) {
  std::vector<double> values;
  for (const int count : steps) values.push_back(137.4 + count * step_mm);
  return values;
}

TEST(Resolution, IsTheStepOfWhichAllReadingsAreMultiples) {
  EXPECT_NEAR(resolutionOf(readings(5e-4, {0, 1, 3, 3, 9, 40, 41})), 5e-4, 1e-10);
  EXPECT_NEAR(resolutionOf(readings(1e-3, {12, 2, 0, 7})), 1e-3, 1e-10);
}

// Two readings one step apart need not occur.
TEST(Resolution, IsSmallerThanTheSmallestDistanceOfTwoReadings) {
  EXPECT_NEAR(resolutionOf(readings(1e-3, {0, 2, 5, 9})), 1e-3, 1e-10);
  EXPECT_NEAR(resolutionOf(readings(1e-3, {0, 6, 15})), 3e-3, 1e-10);
}

TEST(Resolution, IsNothingWithoutAStep) {
  std::mt19937_64 random{1};
  std::vector<double> values;
  for (int k = 0; k < 50; ++k) values.push_back(std::normal_distribution<double>{0, 1e-3}(random));
  EXPECT_EQ(resolutionOf(values), 0.0);
  EXPECT_EQ(resolutionOf(readings(1e-3, {4, 4, 4})), 0.0) << "equal readings show none";
  EXPECT_EQ(resolutionOf({}), 0.0);
}

}  // namespace
}  // namespace probebox::metrology
