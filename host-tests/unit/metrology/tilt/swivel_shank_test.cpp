// A swivelling head that is read with a tip and with the shank above it (B.7, B.8).
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/swivelling_head.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::HasSubstr;

constexpr double kTip_mm = 150;
constexpr double kShank_mm = 100;
constexpr double kRadii_mm = 12.5 + 5;

struct Touched {
  double b{};
  Vector3d side;
};

// Across the tool, which swivels about the axis. Where the head is swivelled the side that looks down is the stem's.
std::vector<Touched> sidesAt(const Head& head, const std::vector<double>& angles) {
  std::vector<Touched> all;
  for (const double b : angles) {
    const Eigen::AngleAxisd swung{b * kDegree, head.axis};
    for (const Vector3d& side : {Vector3d::UnitX().eval(), (-Vector3d::UnitX()).eval(), Vector3d::UnitY().eval(),
                                 (-Vector3d::UnitY()).eval()}) {
      const Vector3d turned = swung * side;
      if (turned.z() > -0.1) all.push_back({b, turned});
    }
  }
  return all;
}

// What the mean of two touches reports along its side, half a turn of the spindle between them.
double touched(const Head& head, const Touched& one, double radii_mm) {
  return one.side.dot(head.reported(one.b, kShank_mm)) + radii_mm;
}

Dataset tipAndShank(const Head& head, const std::vector<double>& angles, double sigma, double ratio,
                    std::mt19937_64& random) {
  Dataset dataset = swivelDataset(head, angles, {kTip_mm}, sigma, random);
  auto& shank = dataset.tables.emplace_back(Table::withColumns(
      "shank", std::array<std::string_view, 8>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm", "ux", "uy", "uz"}));
  for (const auto& one : sidesAt(head, angles)) {
    // The rest of a touch counts nothing.
    const Vector3d beside = one.side.cross(Vector3d{0.3, -0.7, 0.5});
    const Vector3d at = (touched(head, one, kRadii_mm) + gauss(random, ratio * sigma)) * one.side + beside;
    shank.append({one.b, kShank_mm, at.x(), at.y(), at.z(), one.side.x(), one.side.y(), one.side.z()});
  }
  if (sigma > 0) dataset.config["sigma_shank_mm"] = ratio * sigma;
  return dataset;
}

// Along the tool a length is what it is said to be.
Head headOf(std::mt19937_64& random, const Vector3d& axis) {
  Head head = randomHead(random);
  head.axis = axis;
  head.skew = {uniform(random, -1e-4, 1e-4), uniform(random, -1e-4, 1e-4), uniform(random, -1e-4, 1e-4)};
  head.skew -= axis * axis.dot(head.skew);
  head.direction.z() = 0;
  return head;
}

TEST(SwivelErrorByShank, FindsWhatTheControlIsOffAtEveryLength) {
  std::mt19937_64 random{21};
  for (const Vector3d& axis : {Vector3d{0, 1, 0}, Vector3d{0, -1, 0}, Vector3d{1, 0, 0}, Vector3d{-1, 0, 0}}) {
    Head head = headOf(random, axis);
    const auto solved = solve(tipAndShank(head, {0, 45, 90}, 0.0, 1, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // The skew turns the tool's plane a little: second-order terms of the head itself.
    EXPECT_LT(worst(solved.value(), head), 3e-5);
    EXPECT_NEAR(solved->find("shank_effective_radius_mm")->value(), kRadii_mm, 1e-5);
    head.skew = {0, 0, 0};
    const auto straight =
        solve(tipAndShank(head, {0, 45, 90}, 1e-11, 1, random));  // without noise it is frozen along Y
    ASSERT_TRUE(straight.ok()) << straight.error().reason;
    EXPECT_LT(worst(straight.value(), head), 1e-9);
  }
}

TEST(SwivelErrorByShank, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{22};
  Judgement judgement;
  for (int trial = 0; trial < 300; ++trial) {
    Head head = headOf(random, {0, 1, 0});
    head.skew = {0, 0, 0};
    const double sigma = uniform(random, 3e-4, 3e-3), ratio = uniform(random, 0.7, 2.5);
    const std::vector<double> angles{0, 30 + uniform(random, 0, 30), 90};
    // Unknowns: the ball (3), gauge line (2) and direction (1) in the plane; along the axis the four terms and what the
    // shank reports otherwise; the radii. The terms along the axis are those of no real head: any function of B.
    const auto measured = [&](const VectorXd& p) {
      Head guess = head;
      guess.ball = p.head<3>();
      guess.gauge.x() = p[3];
      guess.gauge.z() = p[4];
      guess.direction.x() = p[5] / 100;
      const auto along = [&](double b, double length) {
        const double s = std::sin(b * kDegree), c = 1 - std::cos(b * kDegree), l = length / 100;
        return (p[6] + p[7] * l) * s + (p[8] + p[9] * l) * c;
      };
      std::vector<double> values;
      for (const double b : angles) {
        const Vector3d at = guess.reported(b, kTip_mm) + along(b, kTip_mm) * Vector3d::UnitY();
        values.insert(values.end(), {at.x(), at.y(), at.z()});
      }
      for (const auto& one : sidesAt(head, angles)) {
        const double beside = along(one.b, kShank_mm) + p[10];
        values.push_back((touched(guess, one, p[11]) + one.side.y() * beside) / ratio);
      }
      return VectorXd{Eigen::Map<VectorXd>{values.data(), static_cast<Eigen::Index>(values.size())}};
    };
    VectorXd truth = VectorXd::Zero(12);
    truth << head.ball, head.gauge.x(), head.gauge.z(), 100 * head.direction.x(), 0, 0, 0, 0, 0, kRadii_mm;
    const auto covariance = smallestCovariance(measured, truth, sigma);
    const auto solved = solve(tipAndShank(head, angles, sigma, ratio, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& direction = *solved->find("tool_direction_rad");  // in the order (z, x)
    EXPECT_EQ(direction.values[0], 0) << "along the tool";
    judgement.add(direction.values[1] - head.direction.x(), direction.sd[1], std::sqrt(covariance(5, 5)) / 100);
  }
  expectHonest(judgement);
}

TEST(SwivelErrorByShank, StatesItsUncertaintyAtEveryQuery) {
  std::mt19937_64 random{23};
  Moments pull;
  for (int trial = 0; trial < 300; ++trial) {
    Head head = headOf(random, {0, 1, 0});
    const double sigma = uniform(random, 3e-4, 3e-3);
    const auto solved = solve(tipAndShank(head, {-90, -45, 0, 45, 90}, sigma, 1.6, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    addErrors(pull, solved.value(), head);
  }
  expectHonest(pull, 3 * 300);  // the errors of one fit share its noise
}

TEST(SwivelErrorByShank, RefusesWhatAShankCannotTell) {
  std::mt19937_64 random{24};
  const auto refusal = [&](auto&& spoil) {
    Dataset dataset = tipAndShank(headOf(random, {0, 1, 0}), {0, 45, 90}, 1e-3, 1, random);
    spoil(dataset);
    const auto solved = solve(dataset);
    return solved.ok() ? std::string{} : solved.error().name;
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["model"] = std::string{"free"}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["sigma_shank_mm"] = -1.0; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["swivel_axis"] = std::vector<double>{0, 0, 1}; }), "bad-direction");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "shank", "ux")[0] = 0.5; }), "bad-direction");
  EXPECT_EQ(refusal([](Dataset& d) {
              columnNamed(d, "shank", "ux")[0] = 0;
              columnNamed(d, "shank", "uz")[0] = 1;
            }),
            "bad-direction")
      << "along the tool";
  EXPECT_EQ(refusal([](Dataset& d) {
              Table& shank = tableNamed(d, "shank");
              for (std::size_t row = 0; row < shank.rows(); ++row) {
                auto& uy = columnNamed(d, "shank", "uy")[row];
                auto& ux = columnNamed(d, "shank", "ux")[row];
                uy = std::abs(uy);
                if (columnNamed(d, "shank", "uz")[row] == 0) ux = std::abs(ux);
              }
            }),
            "not-opposed");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "readings", "L_mm")[0] = 200; }), "several-tips");
  EXPECT_EQ(refusal([](Dataset& d) {
              for (double& length : columnNamed(d, "shank", "L_mm")) length = kTip_mm - 9;
            }),
            "length-span-too-small");
}

}  // namespace
}  // namespace probebox::metrology
