// The source's steps to the centre of a large chuck, as an operator goes through them on a machine.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/centreline/limited_access.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/large_chuck.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;

TEST(CentrelineBySteps, FitStatesItsUncertaintyAndSoDoTheStepsWhereTheyCount) {
  std::mt19937_64 random{1};
  for (const bool trust : {true, false}) {
    std::array<Moments, 3> pulls;
    int refused = 0;
    for (int trial = 0; trial < 2000; ++trial) {
      Chuck chuck = randomChuck(random);
      if (trial % 2 == 0) chuck.sigma_c = 1e-6;
      Dataset dataset = goThrough(chuck, uniform(random, 30, 45) * kDegree, random);
      dataset.config["trust_C_angles"] = trust;
      const auto solved = solve(dataset);
      if (!solved) {
        EXPECT_EQ(solved.error().name, "steps-disagree");
        ++refused;
        continue;
      }
      for (std::size_t k = 0; k < 2; ++k) {
        pulls[k].add(solved->find("centre_mm")->values[k] - chuck.centre[static_cast<Eigen::Index>(k)],
                     solved->find("centre_mm")->sd[k]);
      }
      pulls[2].add(solved->find("radius_mm")->value() - chuck.radius, solved->find("radius_mm")->sd[0]);
    }
    EXPECT_LE(refused, 2) << "of 2000 good ones";
    for (const auto& pull : pulls) {
      expectHonest(pull);
      EXPECT_LT(std::abs(pull.bias()), 4.5);
    }
  }
}

// C stops beside what it is asked for, as far as a step takes it, and reports where.
TEST(CentrelineBySteps, IsAsUncertainAsItSaysWhereTheAnglesAreMeasured) {
  std::mt19937_64 random{11};
  for (const double most_off : {2e-5, 1e-3, kPoseTolerance_rad}) {
    for (const bool trust : {true, false}) {
      std::array<Moments, 3> pulls;
      int refused = 0;
      for (int trial = 0; trial < 500; ++trial) {
        Chuck chuck = randomChuck(random);
        chuck.most_off = most_off;
        if (trial % 2 == 0) chuck.sigma_c = 1e-6;
        Dataset dataset = goThrough(chuck, uniform(random, 30, 45) * kDegree, random);
        dataset.config["trust_C_angles"] = trust;
        const auto solved = solve(dataset);
        if (!solved) {
          EXPECT_EQ(solved.error().name, "steps-disagree");
          ++refused;
          continue;
        }
        for (std::size_t k = 0; k < 2; ++k) {
          pulls[k].add(solved->find("centre_mm")->values[k] - chuck.centre[static_cast<Eigen::Index>(k)],
                       solved->find("centre_mm")->sd[k]);
        }
        pulls[2].add(solved->find("radius_mm")->value() - chuck.radius, solved->find("radius_mm")->sd[0]);
      }
      SCOPED_TRACE(testing::Message() << most_off << " rad, trusted: " << trust);
      EXPECT_LE(refused, 2) << "of 500 good ones";
      for (const auto& pull : pulls) expectHonest(pull);
    }
  }
}

// The ball is read several times at each stop of the last loop.
TEST(CentrelineBySteps, CountsTheErrorOfAStopOnceWhereReadingsAreRepeated) {
  std::mt19937_64 random{33};
  Moments errors;
  for (int trial = 0; trial < 500; ++trial) {
    Chuck chuck = randomChuck(random);
    chuck.psi = 0.0;
    chuck.stylus = {0.0, 0.0};
    const double sigma_c = 2e-6;
    Dataset dataset{.method = "centreline-by-steps",
                    .config = {{"sigma_mm", chuck.sigma}, {"sigma_C_rad", sigma_c}, {"level_limit_mm", 0.1}},
                    .tables = {}};
    Table& table = addTable(dataset, "readings", {"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"});
    for (const double c : {0.6, -0.6, 0.0}) {
      const double off = gauss(random, sigma_c);
      for (int k = 0; k < 6; ++k) {
        const Vector2d at = chuck.reading(c + off, random);
        table.append({1.0, c, at.x(), at.y()});
      }
    }
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& centre = *solved->find("centre_mm");
    for (std::size_t k = 0; k < 2; ++k) {
      errors.add(centre.values[k] - chuck.centre[static_cast<Eigen::Index>(k)], centre.sd[k]);
    }
  }
  expectHonest(errors, 500);
}

TEST(CentrelineBySteps, RefusesAStepThatIsFurtherBesideItsAngle) {
  std::mt19937_64 random{12};
  Dataset dataset = goThrough({}, 40 * kDegree, random);
  columnNamed(dataset, "readings", "C_rad_clockwise_from_plus_y")[1] += 5e-3;
  EXPECT_EQ(refusalOf(dataset), "missing-step");
}

// A control may count C from 0 to 360 degrees.
TEST(CentrelineBySteps, TakesAnglesWholeTurnsApart) {
  std::mt19937_64 random{13};
  const Chuck chuck;
  Dataset dataset = goThrough(chuck, 30 * kDegree, random);
  const auto solved = solve(dataset);
  for (double& c : columnNamed(dataset, "readings", "C_rad_clockwise_from_plus_y")) {
    if (c < 0) c += kTurn;
  }
  const auto counted = solve(dataset);
  ASSERT_TRUE(solved.ok() && counted.ok()) << counted.error().reason;
  for (const char* key : {"fit_centre_mm", "steps_centre_mm"}) {
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(counted->find(key)->values[k], solved->find(key)->values[k], 1e-7) << key;
    }
  }
}

TEST(CentrelineBySteps, StepsAndFitAgreeWithoutNoise) {
  std::mt19937_64 random{2};
  for (int trial = 0; trial < 30; ++trial) {
    Chuck chuck = randomChuck(random);
    chuck.sigma = 0.0;
    const auto solved = solve(goThrough(chuck, 40 * kDegree, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("fit_centre_mm")->values[0], chuck.centre.x(), 1e-8);
    EXPECT_NEAR(solved->find("fit_centre_mm")->values[1], chuck.centre.y(), 1e-8);
    EXPECT_NEAR(solved->find("steps_centre_mm")->values[0], chuck.centre.x(), 1e-6);
    EXPECT_NEAR(solved->find("steps_centre_mm")->values[1], chuck.centre.y(), 1e-6);
    EXPECT_NEAR(solved->find("C_shift_rad")->value(), -chuck.psi, 1e-9);
    EXPECT_NEAR(solved->find("stylus_offset_mm")->values[0], chuck.stylus.x(), 1e-9);
  }
}

// A scale of C that is off by a thousandth: the fit believes the angles, the steps use that theta is the same twice.
TEST(CentrelineBySteps, RefusesWhenTheAnglesOfCAreNotWhatTheySay) {
  std::mt19937_64 random{3};
  const Chuck chuck;
  Dataset dataset = goThrough(chuck, 40 * kDegree, random);
  for (double& c : columnNamed(dataset, "readings", "C_rad_clockwise_from_plus_y")) c *= 1.001;
  EXPECT_EQ(refusalOf(dataset), "steps-disagree");
  dataset.config["trust_C_angles"] = false;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("steps count")));
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(solved->find("centre_mm")->values[k], chuck.centre[static_cast<Eigen::Index>(k)],
                5.0 * solved->find("centre_mm")->sd[k]);
  }
}

// The angles of C being wrong says nothing against the steps, so what judges the fit does not stand beside them.
TEST(CentrelineBySteps, TellsOfTheStepsAloneWhereTheAnglesAreNotTrusted) {
  std::mt19937_64 random{5};
  Dataset dataset = goThrough({}, 40 * kDegree, random);
  for (double& c : columnNamed(dataset, "readings", "C_rad_clockwise_from_plus_y")) c *= 1.001;
  dataset.config["trust_C_angles"] = false;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_FALSE(solved->chi2_reduced);
  EXPECT_THAT(solved->warnings, testing::Not(testing::Contains(testing::HasSubstr("scatter more"))));
  EXPECT_LT(solved->rms, 0.005) << "the fit leaves far more";
  EXPECT_EQ(solved->dof, 1u);
  EXPECT_THAT(solved->condition, testing::AllOf(testing::Gt(5.0), testing::Lt(500.0)));
}

TEST(CentrelineBySteps, SaysThatItDoesNotCompareWithoutSigma) {
  std::mt19937_64 random{6};
  for (const bool trust : {true, false}) {
    Dataset dataset = goThrough({}, 40 * kDegree, random);
    dataset.config.erase("sigma_mm");
    dataset.config.erase("sigma_C_rad");
    dataset.config["trust_C_angles"] = trust;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("not compared")));
    EXPECT_EQ(solved->find("centre_mm")->sd.empty(), !trust);
  }
}

// The spindle along Y or X: its half turn moves the stylus in z and one other coordinate, and tells nothing of the
// third. What the stylus is off along the spindle is its length, which stays in the readings.
Dataset lyingStylus(const Chuck& chuck, bool along_y, double off_z, std::mt19937_64& random) {
  Dataset dataset = goThrough(chuck, 40 * kDegree, random);
  Table& stylus = tableNamed(dataset, "stylus");
  stylus.columns.erase(stylus.columns.begin() + (along_y ? 2 : 1));
  stylus.columns.push_back({"z_mm", {}});
  for (const double a : {0.0, std::numbers::pi}) {
    stylus.columns.back().values.push_back(75.0 - std::cos(a) * off_z + gauss(random, chuck.sigma));
  }
  Table& readings = tableNamed(dataset, "readings");
  readings.columns.push_back({"z_mm", {}});
  auto& heights = readings.columns.back().values;
  while (heights.size() < readings.columns[0].values.size())
    heights.push_back(75.0 - off_z + gauss(random, chuck.sigma));
  return dataset;
}

TEST(CentrelineBySteps, TakesTheOffsetOfAStylusThatLiesInTheXyPlaneOffXOrYAndZ) {
  std::mt19937_64 random{8};
  for (const bool along_y : {true, false}) {
    std::array<Moments, 3> pulls;
    for (int trial = 0; trial < 300; ++trial) {
      Chuck chuck = randomChuck(random);
      if (along_y) chuck.stylus.y() = 0.0;
      if (!along_y) chuck.stylus.x() = 0.0;
      const double off_z = uniform(random, -.05, .05);
      if (trial == 0) chuck.sigma = 0.0;
      Dataset dataset = lyingStylus(chuck, along_y, off_z, random);
      if (trial == 0) dataset.config["sigma_mm"] = 0.001;
      const auto solved = solve(dataset);
      if (!solved) continue;  // four deviations
      const auto& offset = *solved->find("stylus_offset_mm");
      ASSERT_EQ(offset.values.size(), 3U);
      const std::size_t across = along_y ? 0 : 1;
      EXPECT_EQ(offset.values[1 - across], 0.0);
      if (trial == 0) {
        EXPECT_NEAR(offset.values[across], chuck.stylus[along_y ? 0 : 1], 1e-9);
        EXPECT_NEAR(offset.values[2], off_z, 1e-9);
        EXPECT_NEAR(solved->find("height_mm")->value(), 75.0, 1e-9);
        EXPECT_NEAR(solved->find("centre_mm")->values[across], chuck.centre[along_y ? 0 : 1], 1e-9);
        continue;
      }
      for (std::size_t k = 0; k < 2; ++k) {
        pulls[k].add(solved->find("centre_mm")->values[k] - chuck.centre[static_cast<Eigen::Index>(k)],
                     solved->find("centre_mm")->sd[k]);
      }
      pulls[2].add(solved->find("height_mm")->value() - 75.0, solved->find("height_mm")->sd[0]);
    }
    for (const auto& pull : pulls) expectHonest(pull);
  }
}

TEST(CentrelineBySteps, RefusesAStylusReadInThreeCoordinates) {
  std::mt19937_64 random{9};
  Dataset dataset = lyingStylus({}, true, 0.01, random);
  tableNamed(dataset, "stylus").columns.push_back({"y_mm", {600.0, 600.0}});
  EXPECT_EQ(refusalOf(dataset), "unknown-column") << "half a turn tells two";
}

// Another spindle angle in any row of the stylus' table, whatever stands before and after it.
TEST(CentrelineBySteps, TakesNoStylusReadingAtAnotherSpindleAngle) {
  std::mt19937_64 random{7};
  const double half = std::numbers::pi;
  const double quarter = half / 2.0;
  for (const auto& order :
       {std::array{quarter, 0.0, half}, std::array{0.0, quarter, half}, std::array{0.0, half, quarter}}) {
    Dataset dataset = goThrough({}, 40 * kDegree, random);
    Table& table = tableNamed(dataset, "stylus");
    table.append({0.0, table.columns[1].values[0], table.columns[2].values[0]});
    table.columns[0].values = {order.begin(), order.end()};
    EXPECT_EQ(refusalOf(dataset), "not-opposite") << order[0] << " " << order[1] << " " << order[2];
  }
}

TEST(CentrelineBySteps, RefusesAStylusThatIsFarOffTheSpindle) {
  std::mt19937_64 random{21};
  Chuck chuck = randomChuck(random);
  chuck.stylus = {3.0, -8.0};
  Dataset dataset = goThrough(chuck, 40 * kDegree, random);
  EXPECT_EQ(refusalOf(dataset), "");
  columnNamed(dataset, "stylus", "y_mm")[1] *= -1;
  EXPECT_EQ(refusalOf(dataset), "implausible");
}

TEST(CentrelineBySteps, RefusesByName) {
  std::mt19937_64 random{4};
  const auto refusal = [&](double theta, const std::function<void(Dataset&)>& damage) {
    Dataset dataset = goThrough({}, theta * kDegree, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keep = [](Dataset&) {};
  const auto dropLast = [](Dataset& d) {
    Table& table = tableNamed(d, "readings");
    keepRows(table, [&](std::size_t row) { return row + 1 < table.rows(); });
  };
  EXPECT_EQ(refusal(40, keep), "");
  EXPECT_EQ(refusal(14.9, keep), "arc-too-short");
  EXPECT_EQ(refusal(40, dropLast), "missing-step");
  EXPECT_EQ(refusal(40, [](Dataset& d) { columnNamed(d, "readings", "loop")[0] = 3.0; }), "bad-loop");
  EXPECT_EQ(refusal(40, [](Dataset& d) { d.config["level_limit_mm"] = 1e-7; }), "not-level");
  EXPECT_EQ(refusal(40, [](Dataset& d) { columnNamed(d, "stylus", "A_rad")[1] = 0.0; }), "not-opposite");
  EXPECT_EQ(refusal(40,
                    [](Dataset& d) {
                      auto& y = columnNamed(d, "readings", "y_mm");
                      y.back() = y[y.size() - 3];
                    }),
            "level-readings");
  EXPECT_EQ(refusal(40,
                    [](Dataset& d) {
                      Table& table = tableNamed(d, "readings");
                      for (double loop = 3.0; loop <= 6.0; ++loop) {
                        table.append({loop, 0.7, 380.0, 460.0});
                        table.append({loop, -0.7, -380.0, 450.0});
                      }
                    }),
            "too-many-loops");
}

}  // namespace
}  // namespace probebox::metrology
