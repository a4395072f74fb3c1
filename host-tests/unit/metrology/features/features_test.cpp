// Datum features other than the sphere: the stylus ball rolls around them in a simulation that knows their faces.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/touched_features.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(RoundFeature, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement judgement;
  for (int trial = 0; trial < 1500; ++trial) {
    const Round round{{uniform(random, -50, 50), uniform(random, -50, 50)},
                      uniform(random, 5, 60),
                      uniform(random, 0.5, 2.5),
                      trial % 2 == 0};
    const double sigma = uniform(random, 3e-4, 3e-3);
    std::vector<double> angles;
    const double arc = uniform(random, 120, 360) * kDegree;
    const int count = 4 + trial % 9;
    for (int k = 0; k < count; ++k) angles.push_back(arc * (k + 0.1) / count);
    const auto solved = solve(roundDataset(round, angles, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          VectorXd seen{count};
          for (int k = 0; k < count; ++k) {
            seen[k] = (round.touched(angles[static_cast<std::size_t>(k)]) - p.head<2>()).norm() - p[2];
          }
          return seen;
        },
        (VectorXd{3} << round.centre, round.effective()).finished(), sigma);
    const auto& centre = *solved->find("centre_xy_mm");
    judgement.add(centre.values[0] - round.centre.x(), centre.sd[0], std::sqrt(covariance(0, 0)));
    judgement.add(centre.values[1] - round.centre.y(), centre.sd[1], std::sqrt(covariance(1, 1)));
    const auto& radius = *solved->find("radius_mm");
    judgement.add(radius.value() - round.radius, radius.sd[0], std::sqrt(covariance(2, 2)));
  }
  expectHonest(judgement);
}

TEST(RoundFeature, OfFourTouchesIsTheMiddleOfOpposedPairs) {
  std::mt19937_64 random{2};
  for (const bool bore : {false, true}) {
    const auto solved = solve(roundDataset({.bore = bore}, {0, 90 * kDegree, 180 * kDegree, 270 * kDegree}, 0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("centre_xy_mm")->values[0], 12.0, 1e-9);
    EXPECT_NEAR(solved->find("centre_xy_mm")->values[1], -7.0, 1e-9);
    EXPECT_NEAR(solved->find("radius_mm")->value(), 20.0, 1e-9);
    EXPECT_NEAR(solved->find("effective_radius_mm")->value(), bore ? 18.5 : 21.5, 1e-9);
  }
}

TEST(RoundFeature, IsKnownLessAsItsArcShrinks) {
  std::mt19937_64 random{3};
  const auto sd = [&](double half_arc) {
    std::vector<double> angles;
    for (int k = -4; k <= 4; ++k) angles.push_back(half_arc * k / 4.0);
    return solve(roundDataset({}, angles, 1e-6, random))->find("radius_mm")->sd[0];
  };
  EXPECT_NEAR(sd(10 * kDegree) / sd(20 * kDegree), 4.0, 0.3) << "with the square of the arc";
}

// Touched at two heights, the machine may stop at one X and Y to every digit.
TEST(RoundFeature, TakesPointsAtOneXAndYAndTwoHeights) {
  std::mt19937_64 random{41};
  Dataset dataset = roundDataset({}, {0, 1, 2, 3, 4, 5}, 0.001, random);
  Table& points = dataset.tables[0];
  const double x = columnNamed(dataset, "points", "x_mm").front(), y = columnNamed(dataset, "points", "y_mm").front();
  points.append({x, y, -10.0});
  const auto solved = solve(dataset);
  EXPECT_TRUE(solved.ok()) << solved.error().reason;
  points.append({x, y, -5.0});
  EXPECT_EQ(refusalOf(dataset), "duplicated-reading");
}

TEST(RoundFeature, RefusesByName) {
  std::mt19937_64 random{4};
  const auto refusal = [&](const std::vector<double>& angles, const std::function<void(Dataset&)>& damage) {
    Dataset dataset = roundDataset({}, angles, 1e-5, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keep = [](Dataset&) {};
  const std::vector<double> around{0, 1, 2, 3, 4, 5};
  EXPECT_EQ(refusal(around, keep), "");
  EXPECT_EQ(refusal({0, 1}, keep), "too-few-readings");
  EXPECT_EQ(refusal({0, 0.01, 0.02, 0.03}, keep), "arc-too-short");
  EXPECT_EQ(refusal(around, [](Dataset& d) { columnNamed(d, "points", "x_mm")[2] += 0.01; }), "residual-too-large");
  EXPECT_EQ(refusal(around, [](Dataset& d) { d.config["radius_max_mm"] = 19.0; }), "radius-out-of-limits");
  EXPECT_EQ(refusal(around, [](Dataset& d) { d.config["stylus_ball_radius_mm"] = 30.0; }), "radius-out-of-limits");
  EXPECT_EQ(refusal(around,
                    [](Dataset& d) {
                      d.config["feature_axis"] = std::vector<double>{0.6, 0.8, 0};
                    }),
            "bad-axis");
  EXPECT_EQ(refusal(around, [](Dataset& d) { columnNamed(d, "points", "y_mm")[0] = std::nan(""); }), "not-finite");
  EXPECT_EQ(refusal(around,
                    [](Dataset& d) {
                      for (const char* name : {"x_mm", "y_mm"}) columnNamed(d, "points", name)[1] = 0.0;
                      for (const char* name : {"x_mm", "y_mm"}) columnNamed(d, "points", name)[2] = 0.0;
                    }),
            "duplicated-reading");
}

TEST(RoundFeature, DropsAGrossErrorByNameWhenAsked) {
  std::mt19937_64 random{5};
  Dataset dataset = roundDataset({}, {0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6}, 0.001, random);
  dataset.config["robust"] = true;
  columnNamed(dataset, "points", "x_mm")[1] += 0.5;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_FALSE(solved->dropped.empty());
  EXPECT_EQ(solved->dropped.front().name, "point 2");
  EXPECT_NEAR(solved->find("radius_mm")->value(), 20.0, 0.003);
  // The same as if it had never been measured.
  const auto isDropped = [&](std::size_t row) {
    return std::ranges::any_of(solved->dropped,
                               [&](const auto& d) { return d.name == "point " + std::to_string(row + 1); });
  };
  keepRows(tableNamed(dataset, "points"), [&](std::size_t row) { return !isDropped(row); });
  dataset.config.erase("robust");
  EXPECT_NEAR(solve(dataset)->rms, solved->rms, 1e-9);
}

// A boss read at several angles of C serves the centreline as a ball does.
TEST(RoundFeature, ServesAsTheFeatureOfACentreline) {
  std::mt19937_64 random{6};
  Dataset turned{.method = "centreline", .config = {}, .tables = {}};
  addTable(turned, "readings", {"C_rad", "x_mm", "y_mm"});
  for (const double c : {0.0, 2.0, 4.0}) {
    Round round;
    round.centre = Vector2d{0.4, -0.2} + Eigen::Rotation2Dd{c} * Vector2d{30.0, 5.0};
    const auto solved = solve(roundDataset(round, {0, 1, 2, 3, 4, 5}, 0.0, random));
    tableNamed(turned, "readings").append({c, solved->estimates[0].values[0], solved->estimates[0].values[1]});
  }
  EXPECT_NEAR(solve(turned)->find("centre_mm")->values[0], 0.4, 1e-9);
  EXPECT_NEAR(solve(turned)->find("centre_mm")->values[1], -0.2, 1e-9);
}

TEST(OpposedFaces, ReachTheBoundAndStateTheirUncertainty) {
  std::mt19937_64 random{7};
  Judgement judgement;
  for (int trial = 0; trial < 800; ++trial) {
    const Vector3d direction =
        Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)}.normalized();
    const double sigma = uniform(random, 3e-4, 3e-3);
    const double middle = uniform(random, -80, 80);
    const double width = uniform(random, 5, 60);
    const int touches = 1 + trial % 3;
    const auto solved = solve(widthDataset(trial % 2 == 0, middle, width, direction, touches, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // One touch a face: sigma/sqrt2 and sigma sqrt2.
    const auto& found = *solved->find("middle_mm");
    judgement.add(found.value() - middle, found.sd[0], sigma / std::sqrt(2.0 * touches));
    judgement.add(solved->find("width_mm")->value() - width, solved->find("width_mm")->sd[0],
                  sigma * std::sqrt(2.0 / touches));
  }
  expectHonest(judgement);
}

TEST(OpposedFaces, RefuseByName) {
  std::mt19937_64 random{8};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = widthDataset(true, 10, 8, Vector3d::UnitX(), 2, 1e-4, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("width_direction"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["width_direction"] = std::vector<double>{1, 1, 0}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "points", "face")[0] = 3.0; }), "bad-face");
  EXPECT_EQ(refusal([](Dataset& d) { keepRows(tableNamed(d, "points"), [](std::size_t k) { return k < 2; }); }),
            "missing-face");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["stylus_ball_radius_mm"] = 6.0; }), "width-not-positive");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "points", "x_mm")[0] += 0.1; }), "residual-too-large");
}

// A remedy may name a key only where the method has it.
TEST(Remedies, NameRobustWhereItIsAKey) {
  std::mt19937_64 random{11};
  const auto reasonOf = [](Dataset dataset) {
    columnNamed(dataset, "points", "x_mm")[0] += 0.1;
    const auto solved = solve(dataset);
    return solved.ok() ? std::string{} : solved.error().reason;
  };
  EXPECT_THAT(reasonOf(roundDataset({}, {0, 1, 2, 3, 4, 5}, 1e-4, random)), testing::HasSubstr("set robust"));
  const std::string of_faces = reasonOf(widthDataset(true, 10, 8, Vector3d::UnitX(), 2, 1e-4, random));
  EXPECT_THAT(of_faces, testing::HasSubstr("again"));
  EXPECT_THAT(of_faces, testing::Not(testing::HasSubstr("robust")));
}

TEST(CornerFit, StatesItsUncertaintyOfTwoFacesAndOfThree) {
  std::mt19937_64 random{9};
  Moments pull;
  Moments square;
  for (int trial = 0; trial < 600; ++trial) {
    const bool edge = trial % 2 == 0;
    const Block block = randomBlock(random, edge);
    const auto solved = solve(cornerDataset(block, 4 + trial % 3, uniform(random, 3e-4, 3e-3), random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& corner = *solved->find(edge ? "corner_xy_mm" : "corner_mm");
    for (std::size_t k = 0; k < corner.values.size(); ++k) {
      pull.add(corner.values[k] - block.corner[static_cast<Eigen::Index>(k)], corner.sd[k]);
    }
    const double angle = std::acos(block.normals[0].dot(block.normals[1])) - std::numbers::pi / 2.0;
    square.add(solved->find("square_error_rad")->value() - angle, solved->find("square_error_rad")->sd[0]);
  }
  expectHonest(pull);
  expectHonest(square);
  EXPECT_LT(std::abs(pull.bias()), 4.0);
}

RC_GTEST_PROP(CornerFit, IsExactWithoutNoise, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const bool edge = *rc::gen::arbitrary<bool>();
  const Block block = randomBlock(random, edge);
  const auto solved = solve(cornerDataset(block, edge ? 3 : 5, 0.0, random));
  RC_ASSERT(solved.ok());
  const auto& corner = solved->estimates[0].values;
  for (std::size_t k = 0; k < corner.size(); ++k) {
    RC_ASSERT(std::abs(corner[k] - block.corner[static_cast<Eigen::Index>(k)]) < 1e-8);
  }
}

TEST(CornerFit, RefusesByName) {
  std::mt19937_64 random{10};
  const auto refusal = [&](int touches, const std::function<void(Dataset&)>& damage) {
    Dataset dataset = cornerDataset({}, touches, 1e-4, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal(4, [](Dataset&) {}), "");
  EXPECT_EQ(refusal(2, [](Dataset&) {}), "too-few-readings");
  EXPECT_EQ(refusal(4, [](Dataset& d) { d.config.erase("stylus_ball_radius_mm"); }), "missing-key");
  EXPECT_EQ(refusal(4, [](Dataset& d) { columnNamed(d, "points", "face")[0] = 7.0; }), "bad-face");
  EXPECT_EQ(refusal(4, [](Dataset& d) { keepRows(tableNamed(d, "points"), [](std::size_t k) { return k < 8; }); }),
            "missing-face");
  EXPECT_EQ(refusal(4, [](Dataset& d) { columnNamed(d, "faces", "nx")[0] = 2.0; }), "bad-direction");
  EXPECT_EQ(refusal(4, [](Dataset& d) { columnNamed(d, "points", "x_mm")[0] += 0.05; }), "residual-too-large");
  EXPECT_EQ(refusal(4,
                    [](Dataset& d) {
                      columnNamed(d, "points", "y_mm")[0] = 1.0;
                      for (std::size_t k = 1; k < 4; ++k)
                        columnNamed(d, "points", "y_mm")[k] = 1.0 + 1e-9 * static_cast<double>(k);
                    }),
            "collinear");
  // Two touches a face tell a line, but not when they lie on one spot, or close together for how far the corner is.
  const auto spread = [&](double apart, double away) {
    Dataset edge{
        .method = "corner-fit",
        .config = {{"sigma_mm", 1e-3}, {"stylus_ball_radius_mm", 3.0}, {"feature_axis", std::vector{0., 0., 1.}}},
        .tables = {}};
    Table& faces = addTable(edge, "faces", {"face", "nx", "ny", "nz"});
    faces.append({1.0, 1.0, 0.0, 0.0});
    faces.append({2.0, 0.0, 1.0, 0.0});
    Table& points = addTable(edge, "points", {"face", "x_mm", "y_mm", "z_mm"});
    for (const double at : {away - apart / 2.0, away + apart / 2.0}) {
      points.append({1.0, 3.0, -at, 0.0});
      points.append({2.0, -20.0 - at, 3.0, 0.0});
    }
    return refusalOf(edge);
  };
  EXPECT_EQ(spread(20.0, 20.0), "");
  EXPECT_EQ(spread(2.0, 100.0), "");
  EXPECT_EQ(spread(0.01, 20.0), "collinear");
  EXPECT_EQ(spread(2.0, 200.0), "collinear");
  Block parallel;
  parallel.normals = {Vector3d::UnitX(), Vector3d{1.0, 0.06, 0.0}.normalized()};
  Dataset dataset = cornerDataset(parallel, 4, 1e-4, random);
  columnNamed(dataset, "faces", "nx")[1] = 1.0;
  columnNamed(dataset, "faces", "ny")[1] = 0.0;
  EXPECT_EQ(refusalOf(dataset), "faces-parallel");
}

}  // namespace
}  // namespace probebox::metrology
