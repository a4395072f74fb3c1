// Opposed faces read in few digits, no sigma stated: the sd holds what rounding leaves of the means.
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;

struct Faces {
  Vector3d direction{Vector3d::UnitX()};
  double middle{};
  double apart{};  // of the stylus-ball centres
  double noise{3e-4};
  double digit{0.01};
  bool at_one_place{};  // of either face, touched again and again
};

double rounded(double value, double digit) {
  return std::round(value / digit) * digit;
}

Dataset touched(const Faces& faces, const char* method, std::mt19937_64& random) {
  const Vector3d& u = faces.direction;
  Dataset dataset{.method = method,
                  .config = {{"stylus_ball_radius_mm", 1.0}, {"width_direction", std::vector{u.x(), u.y(), u.z()}}},
                  .tables = {}};
  Table& points = addTable(dataset, "points", {"face", "x_mm", "y_mm", "z_mm"});
  const Vector3d along = u.unitOrthogonal();
  for (const double face : {1.0, 2.0}) {
    double place = uniform(random, -3, 3);
    for (int touch = 0; touch < 5; ++touch) {
      if (!faces.at_one_place) place = uniform(random, -3, 3);
      const double off = (face - 1.5) * faces.apart;
      const Vector3d at = (faces.middle + off + gauss(random, faces.noise)) * u + place * along;
      points.append({face, rounded(at.x(), faces.digit), rounded(at.y(), faces.digit), rounded(at.z(), faces.digit)});
    }
  }
  return dataset;
}

// Mean squares of the errors over the sd, of the middle and of the width.
struct Pulls {
  Moments middle, width;
};

Pulls pullsOf(const char* method, Faces faces, std::mt19937_64& random) {
  Pulls pulls;
  for (int trial = 0; trial < 400; ++trial) {
    faces.middle = uniform(random, 5, 20);
    faces.apart = uniform(random, 15, 20);
    const auto solved = solve(touched(faces, method, random));
    if (!solved.ok()) {
      EXPECT_EQ(solved.error().name, "duplicated-reading");
      continue;
    }
    const auto& middle = *solved->find("middle_mm");
    const auto& width = *solved->find("effective_width_mm");
    pulls.middle.add(middle.value() - faces.middle, middle.sd[0]);
    pulls.width.add(width.value() - faces.apart, width.sd[0]);
  }
  EXPECT_GT(pulls.width.count, 200U);
  return pulls;
}

TEST(CoarseFaces, HaveTheSdOfTheirDigits) {
  std::mt19937_64 random{71};
  for (const char* method : {"web-fit", "pocket-fit"}) {
    const auto pulls = pullsOf(method, {}, random);
    EXPECT_THAT(pulls.middle.pull(), AllOf(Gt(0.75), Lt(1.2))) << method;
    EXPECT_THAT(pulls.width.pull(), AllOf(Gt(0.75), Lt(1.2))) << method;
  }
}

// Each place of an inclined face is rounded in its own way, which the scatter shows.
TEST(CoarseFaces, AcrossTheAxesAverageTheirRounding) {
  std::mt19937_64 random{72};
  const auto pulls = pullsOf("web-fit", {.direction = Vector3d{0.6, 0.8, 0.0}}, random);
  EXPECT_THAT(pulls.middle.pull(), AllOf(Gt(0.75), Lt(1.2)));
  EXPECT_THAT(pulls.width.pull(), AllOf(Gt(0.75), Lt(1.2)));
}

TEST(CoarseFaces, SaySoAndAskForASigma) {
  std::mt19937_64 random{73};
  Faces faces{.middle = 12.3456, .apart = 17.8912};
  Dataset dataset = touched(faces, "web-fit", random);
  const auto coarse = solve(dataset);
  ASSERT_TRUE(coarse.ok()) << coarse.error().reason;
  EXPECT_NEAR(coarse->find("middle_mm")->sd[0], 0.01 / std::sqrt(24.0), 1e-6) << "of readings that are all equal";
  EXPECT_NEAR(coarse->find("width_mm")->sd[0], 0.01 / std::sqrt(6.0), 1e-6);
  EXPECT_THAT(coarse->warnings,
              testing::ElementsAre(AllOf(HasSubstr("x_mm"), HasSubstr("0.01 mm"), HasSubstr("state sigma_mm"))));
  dataset.config["sigma_mm"] = 0.003;
  EXPECT_NEAR(solve(dataset)->find("middle_mm")->sd[0], 0.003 / std::sqrt(10.0), 1e-9);
  faces.digit = 1e-6;
  const auto fine = solve(touched(faces, "web-fit", random));
  ASSERT_TRUE(fine.ok()) << fine.error().reason;
  EXPECT_THAT(fine->warnings, testing::IsEmpty());
}

// Readings that alternate between two steps scatter by less than half of one: their noise averages nothing out.
TEST(CoarseFaces, ThatAlternateBetweenTwoStepsHaveTheSdOfTheirDigits) {
  Dataset dataset{.method = "web-fit", .config = {{"width_direction", std::vector{1.0, 0.0, 0.0}}}, .tables = {}};
  Table& points = addTable(dataset, "points", {"face", "x_mm", "y_mm", "z_mm"});
  for (const double face : {1.0, 2.0}) {
    for (int touch = 0; touch < 5; ++touch)
      points.append({face, 12.34 + 17.11 * face + (touch == 1 ? 0.01 : 0.0), 1.27 * touch - 2.13, 0.31 * touch});
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(AllOf(HasSubstr("x_mm"), HasSubstr("0.01 mm"))));
  EXPECT_THAT(solved->find("middle_mm")->sd[0], AllOf(Gt(0.01 / std::sqrt(24.0)), Lt(0.003)));
}

TEST(CoarseFaces, HaveResidualsInMillimetresAsMeasuredMinusFitted) {
  Dataset dataset{.method = "web-fit",
                  .config = {{"width_direction", std::vector{1.0, 0.0, 0.0}}, {"sigma_mm", 0.002}},
                  .tables = {}};
  Table& points = addTable(dataset, "points", {"face", "x_mm", "y_mm", "z_mm"});
  for (const double face : {1.0, 2.0}) {
    for (int touch = 0; touch < 3; ++touch)
      points.append({face, 20.0 * face + (face == 2.0 && touch == 2 ? 0.003 : 0.0), 1.0 * touch, 0.5 * touch});
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->residuals.unit, "mm");
  const std::vector<double> expected{0, 0, 0, -0.001, -0.001, 0.002};
  EXPECT_THAT(solved->residuals.values, testing::Pointwise(testing::DoubleNear(1e-12), expected));
}

}  // namespace
}  // namespace probebox::metrology
