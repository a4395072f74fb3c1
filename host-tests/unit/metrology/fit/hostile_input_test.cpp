// What fits do with no rows, with numbers that are none, and with numbers whose squares are too large.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {
namespace {

using testing::AnyOf;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHostile[]{kNan, kInf, -kInf, 1e308, -1e308, 1e200};

TEST(HostileInput, OfALineIsNoLine) {
  const Line none = fitLine({}, Rows3{0, 3});
  EXPECT_EQ(none.n, 0U);
  EXPECT_TRUE(std::isnan(none.t_mean));
  EXPECT_TRUE(none.slope.array().isNaN().all());
  const std::vector<double> times{0, 1, 2, 3};
  for (const double hostile : kHostile) {
    Rows3 values = Rows3::Zero(4, 3);
    values(1, 0) = hostile;
    EXPECT_FALSE(fitLine(times, values).scatter.allFinite()) << hostile;
    const std::vector<double> bad_times{0, hostile, 2, 3};
    const Line line = fitLine(bad_times, Rows3::Ones(4, 3));
    EXPECT_TRUE(!std::isfinite(line.sxx) || !line.slope.allFinite() || line.slope.isZero()) << hostile;
  }
}

TEST(HostileInput, OfRobustStatisticsIsNaN) {
  std::vector<double> none;
  EXPECT_TRUE(std::isnan(median(none)));
  for (std::size_t at = 0; at < 40; ++at) {
    std::vector<double> values(40, 1.0);
    values[at] = kNan;
    EXPECT_TRUE(std::isnan(deviationAboutZero(values)));
    EXPECT_TRUE(std::isnan(median(values)));
  }
  EXPECT_EQ(deviationAboutZero({}), 0.0);
  EXPECT_EQ(localDeviation({}, {}, Trim::light), 0.0);
}

TEST(HostileInput, OfALinearFitIsRefused) {
  for (const double hostile : kHostile) {
    for (const bool in_design : {true, false}) {
      Eigen::MatrixXd design = Eigen::MatrixXd::Ones(5, 2);
      design.col(1).setLinSpaced(0.0, 4.0);
      Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(5, 0.0, 1.0);
      (in_design ? design(2, 1) : values[2]) = hostile;
      const auto fit = linearLeastSquares(design, values);
      if (!fit) {
        EXPECT_THAT(fit.error().name, AnyOf("not-finite", "ill-conditioned")) << hostile;
        continue;
      }
      EXPECT_TRUE(std::abs(hostile) < kInf) << "nothing but large numbers is fitted";
    }
  }
  EXPECT_EQ(linearLeastSquares(Eigen::MatrixXd::Ones(0, 2), Eigen::VectorXd{}).error().name, "too-few-readings");
  EXPECT_EQ(linearLeastSquares(Eigen::MatrixXd::Ones(2, 0), Eigen::VectorXd::Ones(2)).error().name, "too-few-readings");
}

TEST(HostileInput, OfAnIterationIsRefused) {
  const auto shifted = [](double by) {
    return [by](const Eigen::VectorXd& at) {
      return Linearised{Eigen::VectorXd::Constant(3, at[0] + by), Eigen::MatrixXd::Ones(3, 1)};
    };
  };
  for (const double hostile : {kNan, kInf, -kInf}) {
    EXPECT_EQ(leastSquares(shifted(hostile), Eigen::VectorXd::Zero(1)).error().name, "not-finite") << hostile;
    EXPECT_EQ(leastSquares(shifted(0), Eigen::VectorXd::Constant(1, hostile)).error().name, "not-finite") << hostile;
  }
  const Model nothing = [](const Eigen::VectorXd&) { return Linearised{Eigen::VectorXd{}, Eigen::MatrixXd{0, 1}}; };
  EXPECT_EQ(leastSquares(nothing, Eigen::VectorXd::Zero(1), Outliers::drop_once).error().name, "too-few-readings");
}

}  // namespace
}  // namespace probebox::metrology
