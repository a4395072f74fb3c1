// A swivelling head in three dimensions.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

struct PivotedHead {
  Vector3d axis{0, 1, 0};
  Vector3d pivot{-0.04, 0, -132.0};  // from the moving reference
  Vector3d tip{-0.17, 0, 100.0};     // spindle axis at the stylus' length, from the moving reference, at B = 0
  Vector3d stylus{0.02, -0.04, 0};   // from the spindle axis
  Vector3d ball{18.0, -9.0, -8.0};

  Vector3d reading(double b, double a) const {
    const Vector3d at_zero = tip + AngleAxisd{a * kDegree, Vector3d::UnitZ()} * stylus;
    return ball - (pivot + AngleAxisd{b * kDegree, axis} * (at_zero - pivot));
  }
};

TEST(HeadPivot, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{4};
  Judgement judgement;
  for (int trial = 0; trial < 600; ++trial) {
    PivotedHead head;
    head.axis.y() = trial % 3 == 0 ? -1.0 : 1.0;
    head.pivot = {uniform(random, -.1, .1), 0, uniform(random, -200, -80)};
    const double sigma = uniform(random, 3e-4, 3e-3);
    Dataset dataset{.method = "head-pivot",
                    .config = {{"sigma_mm", sigma},
                               {"ball_mm", std::vector<double>{head.ball.x(), head.ball.y(), head.ball.z()}},
                               {"swivel_axis", std::vector<double>{0, head.axis.y(), 0}}},
                    .tables = {}};
    Table& readings = addTable(dataset, "readings", {"B_deg", "A_deg", "x_mm", "y_mm", "z_mm"});
    for (const double b : {0.0, 90.0}) {
      for (const double a : {0.0, 180.0}) {
        const Vector3d at = head.reading(b, a);
        readings.append(
            {b, a, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
      }
    }
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
