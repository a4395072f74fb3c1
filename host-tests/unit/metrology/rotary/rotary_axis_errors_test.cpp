// A rotary table that moves a ball plate by exact rotations, and beside them by its six errors.
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/fit/rigid_motion.hpp"
#include "host-tests/metrology/ball_plate.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/turned.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Contains;
using testing::HasSubstr;

// All that is unknown: the plate's place (6), the errors of one angle (6); what is read: second, and first at that
// angle.
Eigen::MatrixXd boundOfOneAngle(const RotaryTable& table, const Plate& plate, std::size_t k, double sigma) {
  SixErrors scale;
  scale << 1, 1, 1, .01, .01, .01;  // so that steps of all unknowns move the balls alike
  const auto observe = [&](const VectorXd& p) {
    Plate at = plate;
    at.shift += p.head<3>();
    at.rotation = turned(p.segment<3>(3) * 0.01) * plate.rotation;
    RotaryTable one = table;
    one.errors[k] = p.segment<6>(6).cwiseProduct(scale);
    VectorXd values{static_cast<Eigen::Index>(6 * plate.balls.size())};
    for (std::size_t ball = 0; ball < plate.balls.size(); ++ball) {
      const auto row = static_cast<Eigen::Index>(6 * ball);
      values.segment<3>(row) = at.at(ball);
      values.segment<3>(row + 3) = one.moved(at.at(ball), k);
    }
    return values;
  };
  VectorXd truth = VectorXd::Zero(12);
  truth.tail(6) = table.errors[k].cwiseQuotient(scale);
  const Eigen::MatrixXd covariance = smallestCovariance(observe, truth, sigma);
  return scale.asDiagonal() * covariance.bottomRightCorner(6, 6) * scale.asDiagonal();
}

TEST(RotaryAxis, BeatsTheBoundWithoutTheReadingsAtZeroAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement judgement;
  Moments at_zero;
  Moments location;
  for (int trial = 0; trial < 150; ++trial) {
    Plate plate = plateOf(4 + static_cast<std::size_t>(trial % 5), uniform(random, 60, 150));
    plate.rotation = turned({uniform(random, -.002, .002), uniform(random, -.002, .002), uniform(random, -3, 3)});
    RotaryTable table = randomTable(6, random);
    table.point = {uniform(random, -5, 5), uniform(random, -5, 5), 0};
    if (trial % 3 == 0) table.direction = {0, 1, 0};
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto solved = solve(rotaryDataset(table, plate, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& six = *solved->find("six_errors");
    ASSERT_EQ(six.columns, 6U);
    for (std::size_t k = 0; k < 6; ++k) {
      const auto bound = boundOfOneAngle(table, plate, k, sigma);
      for (std::size_t e = 0; e < 6; ++e) {
        const auto at = static_cast<Eigen::Index>(e);
        const double error = six.values[6 * k + e] - table.errors[k][at];
        if (k == 0) at_zero.add(error, six.sd[6 * k + e]);
        if (k != 0) judgement.add(error, six.sd[6 * k + e], std::sqrt(bound(at, at)));
      }
    }
    // (E7) of the true errors, in another way: Fourier, since the angles are evenly spread. d across the axis.
    const auto& found = *solved->find("location_mm");
    const auto& tilt = *solved->find("tilt_rad");
    Vector3d d = Vector3d::Zero();
    Vector3d theta = Vector3d::Zero();
    const Matrix3d across = Matrix3d::Identity() - table.direction * table.direction.transpose();
    for (std::size_t k = 0; k < 6; ++k) {
      const Matrix3d back = AngleAxisd{-table.angles[k], table.direction}.toRotationMatrix();
      d -= back * across * table.errors[k].head<3>() / 6.0;
      theta -= back * across * table.errors[k].tail<3>() / 6.0;
    }
    for (std::size_t e = 0; e < 3; ++e) {
      if (std::abs(table.direction[static_cast<Eigen::Index>(e)]) > 0.5) {
        EXPECT_NEAR(found.values[e], 0.0, 1e-12) << "there is no location along the axis";
        continue;
      }
      location.add(found.values[e] - d[static_cast<Eigen::Index>(e)], found.sd[e]);
      location.add(tilt.values[e] - theta[static_cast<Eigen::Index>(e)], tilt.sd[e]);
    }
  }
  EXPECT_THAT(judgement.efficiency(), testing::AllOf(testing::Gt(1.15), testing::Lt(1.55))) << "4/3 with the zero";
  expectHonest(judgement.pulls);
  expectHonest(at_zero);
  expectHonest(location);
  EXPECT_LT(std::abs(judgement.pulls.bias()), 4.0);
}

TEST(RotaryAxis, IsExactWithoutNoiseEvenForLargeErrors) {
  std::mt19937_64 random{2};
  for (const double magnified : {1.0, 30.0}) {
    RotaryTable table = randomTable(5, random);
    for (auto& errors : table.errors) errors *= magnified;
    Dataset dataset = rotaryDataset(table, plateOf(4, 120), 0.0, random);
    // A station may see some of the balls only.
    keepRows(tableNamed(dataset, "first"), [](std::size_t row) { return row != 2 && row != 8; });
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 5; ++k) {
      for (std::size_t e = 0; e < 6; ++e) {
        EXPECT_NEAR(solved->find("six_errors")->values[6 * k + e], table.errors[k][static_cast<Eigen::Index>(e)], 1e-9);
      }
    }
  }
}

TEST(RotaryAxis, RegistersThePlateOfTheWorkedExample) {
  Plate plate;
  plate.balls = {{120, 0, 40}, {0, 120, 60}, {-120, 0, 40}, {0, -120, 60}};
  EXPECT_TRUE(plate.at(0).isApprox(Vector3d{117.976170071, 23.456725826, 55.143021928}, 1e-11));
  Eigen::MatrixX3d from{4, 3};
  Eigen::MatrixX3d to{4, 3};
  for (std::size_t k = 0; k < 4; ++k) {
    from.row(static_cast<Eigen::Index>(k)) = plate.balls[k].transpose();
    to.row(static_cast<Eigen::Index>(k)) = plate.at(k).transpose();
  }
  const auto motion = registerRigid(from, to);
  ASSERT_TRUE(motion.ok());
  EXPECT_TRUE(motion->rotation.isApprox(plate.rotation, 1e-12));
  EXPECT_TRUE(motion->shift.isApprox(plate.shift, 1e-12));
  EXPECT_TRUE(rotationVector(plate.rotation).isApprox(Vector3d{.002, -.001, .2}, 1e-12));
}

TEST(RotaryAxis, FindsTheLocationOfTheWorkedExample) {
  std::mt19937_64 random{3};
  RotaryTable table;
  const Vector3d d{.012, -.007, 0};
  for (int k = 0; k < 4; ++k) {
    table.angles.push_back(kTurn * k / 4.0);
    SixErrors errors = SixErrors::Zero();
    errors.head<3>() = d - AngleAxisd{table.angles.back(), table.direction} * d;
    table.errors.push_back(errors);
  }
  EXPECT_TRUE(table.errors[1].head<2>().isApprox(Eigen::Vector2d{.005, -.019}, 1e-12));
  const auto solved = solve(rotaryDataset(table, plateOf(4, 120), 0.0, random));
  EXPECT_NEAR(solved->find("location_mm")->values[0], .012, 1e-9);
  EXPECT_NEAR(solved->find("location_mm")->values[1], -.007, 1e-9);
  EXPECT_NEAR(solved->find("tilt_rad")->values[0], 0.0, 1e-12);
}

// (E8): second harmonics are no location, first ones are.
TEST(RotaryAxis, TabulatesWhatDependsOnThePosition) {
  std::mt19937_64 random{31};
  Moments left;
  for (int trial = 0; trial < 40; ++trial) {
    const double sigma = trial == 0 ? 0.0 : 0.001;
    RotaryTable table;
    table.direction = trial % 2 == 0 ? Vector3d{0, 0, 1} : Vector3d{0, 1, 0};
    const Matrix3d across = Matrix3d::Identity() - table.direction * table.direction.transpose();
    const Vector3d d = across * Vector3d{.012, -.007, .009};
    const Vector3d theta = across * Vector3d{3e-5, 2e-5, -4e-5};
    SixErrors second;
    second << .002, -.001, .003, 2e-5, -1e-5, 3e-5;
    std::vector<SixErrors> dependent;
    for (int k = 0; k < 8; ++k) {
      const double phi = kTurn * k / 8.0;
      const Matrix3d turned_back = Matrix3d::Identity() - AngleAxisd{phi, table.direction}.toRotationMatrix();
      dependent.push_back(second * std::cos(2.0 * phi));
      SixErrors errors = dependent.back() - dependent.front();
      errors.head<3>() += turned_back * d;
      errors.tail<3>() += turned_back * theta;
      table.angles.push_back(phi);
      table.errors.push_back(errors);
    }
    Dataset dataset = rotaryDataset(table, plateOf(6, 120), sigma, random);
    dataset.config["sigma_mm"] = 0.001;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (const auto& [key, first] : {std::pair{"position_dependent_mm", 0}, {"position_dependent_rad", 3}}) {
      const auto& found = *solved->find(key);
      ASSERT_EQ(found.columns, 3U);
      ASSERT_EQ(found.sd.size(), 24U);
      for (std::size_t part = 0; part < 24; ++part) {
        const auto e = first + static_cast<Eigen::Index>(part % 3);
        const double error = found.values[part] - dependent[part / 3][e];
        if (trial > 0) {
          left.add(error, found.sd[part]);
        } else {
          EXPECT_NEAR(error, 0.0, 2e-9) << key << " " << part;
        }
      }
    }
  }
  expectHonest(left);
}

TEST(RotaryAxis, LeavesTheReadingsAtZeroOutWhereTheAxisDidNotReturn) {
  std::mt19937_64 random{4};
  RotaryTable table = randomTable(6, random);
  table.errors[0] << .02, -.01, 0, 0, 0, 1e-4;
  const auto solved = solve(rotaryDataset(table, plateOf(6, 120), 0.001, random));
  ASSERT_TRUE(solved.ok());
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("axis returned")));
  EXPECT_NEAR(solved->find("six_errors")->values[0], .02, 5e-3);
  EXPECT_NEAR(solved->find("six_errors")->values[6], table.errors[1][0], 5e-3);
}

// A table that comes back 5.6 sd off in one of its six errors, without a stated sigma.
TEST(RotaryAxis, SeesThatTheAxisDidNotReturnWithoutSigmaToo) {
  std::mt19937_64 random{8};
  const auto seen = [&](double off_mm) {
    int disagree = 0;
    for (int trial = 0; trial < 200; ++trial) {
      RotaryTable table = randomTable(1, random);
      table.errors[0].setZero();
      table.errors[0][0] = off_mm;
      Dataset dataset = rotaryDataset(table, plateOf(8, 120), 0.001, random);
      dataset.config.erase("sigma_mm");
      const auto solved = solve(dataset);
      EXPECT_TRUE(solved.ok());
      if (testing::Matches(Contains(HasSubstr("axis returned")))(solved->warnings)) ++disagree;
    }
    return disagree;
  };
  EXPECT_LE(seen(0.0), 6);
  EXPECT_GE(seen(0.0028), 150) << "chi-square of 6 errors about 37, with a limit of 20";
}

TEST(RotaryAxis, ResidualRmsIsThatOfTheReadings) {
  std::mt19937_64 random{9};
  const auto solved = solve(rotaryDataset(randomTable(5, random), plateOf(6, 120), 0.001, random));
  const double squares = *solved->chi2_reduced * static_cast<double>(solved->dof) * 1e-6;
  EXPECT_NEAR(solved->rms, std::sqrt(squares / (3.0 * 6.0 * 6.0)), 1e-12);
}

TEST(RotaryAxis, HasNoLocationFromFewAngles) {
  std::mt19937_64 random{5};
  const auto solved = solve(rotaryDataset(randomTable(3, random), plateOf(4, 120), 0.001, random));
  ASSERT_TRUE(solved.ok());
  EXPECT_EQ(solved->find("location_mm"), nullptr);
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("no location")));
}

TEST(RotaryAxis, RefusesByName) {
  std::mt19937_64 random{6};
  const RotaryTable table = randomTable(4, random);
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = rotaryDataset(table, plateOf(4, 120), 0.001, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keepBalls = [](Dataset& d, const char* name, const std::function<bool(double)>& which) {
    const auto balls = columnNamed(d, name, "ball");
    keepRows(tableNamed(d, name), [&](std::size_t row) { return which(balls[row]); });
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([&](Dataset& d) { keepBalls(d, "third", [](double ball) { return ball != 2.0; }); }),
            "missing-ball");
  EXPECT_EQ(refusal([&](Dataset& d) { keepBalls(d, "first", [](double ball) { return ball < 2.0; }); }),
            "too-few-balls");
  EXPECT_EQ(refusal([&](Dataset& d) { keepBalls(d, "second", [](double ball) { return ball < 2.0; }); }),
            "too-few-balls");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "third", "ball")[1] = 0.0; }), "duplicated-ball");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "second", "x_mm")[1] += 0.02; }), "residual-too-large");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("axis_direction"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["axis_direction"] = std::vector<double>{0, 0, 2}; }), "bad-config");
  Plate line = plateOf(4, 120);
  line.balls = {{0, 0, 0}, {10, 20, 30}, {20, 40, 60}, {30, 60, 90}};
  EXPECT_EQ(refusalOf(rotaryDataset(table, line, 0.001, random)), "collinear");
}

// B carries C: the point is moved by exact rotations with the errors of both, and compared.
TEST(RotaryAxis, ChainOfTwoAxesMovesAPointAsTheMachineDoes) {
  std::mt19937_64 random{7};
  for (int trial = 0; trial < 100; ++trial) {
    const auto errors = [&] {
      SixErrors values;
      for (Eigen::Index e = 0; e < 6; ++e) values[e] = uniform(random, -1, 1) * (e < 3 ? 0.01 : 5e-5);
      return values;
    };
    struct Link {
      Vector3d point, direction;
      double angle;
      SixErrors errors;
    };
    const std::array links{Link{{5, 0, -40}, Vector3d::UnitY(), uniform(random, -1.5, 1.5), errors()},
                           Link{{1, 2, 0}, Vector3d::UnitZ(), uniform(random, -3, 3), errors()}};
    const Vector3d point{uniform(random, -150, 150), uniform(random, -150, 150), uniform(random, 0, 100)};
    Vector3d real = point;
    Vector3d ideal = point;
    CarriedPoint carried{point};
    for (const std::size_t k : {1U, 0U}) {
      const auto& link = links[k];
      const AngleAxisd turn{link.angle, link.direction};
      real = link.point + link.errors.head<3>() + turned(link.errors.tail<3>()) * (turn * (real - link.point));
      ideal = link.point + turn * (ideal - link.point);
      carried.carry(link.point, link.direction, AngleWithSine{link.angle}, link.errors);
    }
    EXPECT_LT((carried.off() - (real - ideal)).norm(), 5e-6) << "second order of 20 um";
  }
}

}  // namespace
}  // namespace probebox::metrology
