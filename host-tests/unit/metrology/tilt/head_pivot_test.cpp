// A swivelling head in three dimensions.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/pivoted_head.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

TEST(HeadPivot, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{4};
  Judgement judgement;
  for (int trial = 0; trial < 600; ++trial) {
    PivotedHead head;
    head.axis.y() = trial % 3 == 0 ? -1.0 : 1.0;
    head.pivot = {uniform(random, -.1, .1), 0, uniform(random, -200, -80)};
    const double sigma = uniform(random, 3e-4, 3e-3);
    Dataset dataset = pivotDataset(head, sigma, random);
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& pivot = *solved->find("pivot_xz_mm");
    judgement.add(pivot.values[0] - head.pivot.x(), pivot.sd[0], sigma / std::numbers::sqrt2);
    judgement.add(pivot.values[1] - head.pivot.z(), pivot.sd[1], sigma / std::numbers::sqrt2);
    EXPECT_EQ(solved->dof, 2U);
    dataset.config.erase("ball_mm");
    EXPECT_EQ(refusalOf(dataset), "missing-key");
  }
  expectHonest(judgement);
}

}  // namespace
}  // namespace probebox::metrology
