// What a table or a head that stands still is off is in every reading alike: no residual shows it, and every sd has to.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/mill_turn.hpp"
#include "host-tests/metrology/moments.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;

// One sd of a stop moves a reading by a part of its own and one along the lever.
struct StandingStop {
  StandingAxis axis;
  Vector2d by_mm;
  Vector2d by_lever;

  Vector2d at(double lever) const { return by_mm + lever * by_lever; }
};

StandingStop tableAboutX(double sigma) {
  return {kTableStands, {0, -2 * sigma}, {0, -sigma / 50}};
}
StandingStop headAboutY(double sigma) {
  return {kHeadStands, {3 * sigma, 0}, {0, 0}};
}

Dataset measuredAtStops(const std::string& method, const std::string& lever, std::vector<Row> rows, double sigma,
                        const std::vector<StandingStop>& stops, std::mt19937_64& random) {
  std::vector<double> off;
  for (std::size_t i = 0; i < stops.size(); ++i) off.push_back(gauss(random, 1));
  for (auto& row : rows) {
    for (std::size_t i = 0; i < stops.size(); ++i) row.at += off[i] * stops[i].at(row.lever);
  }
  blur(rows, sigma, random);
  Dataset dataset = ballDataset(method, lever, rows, sigma);
  for (const auto& stop : stops) {
    Table shift{.name = "readings" + std::string{stop.axis.suffix}, .columns = {{"x_mm", {}}, {"y_mm", {}}}};
    for (const auto& row : rows) {
      shift.columns[0].values.push_back(stop.at(row.lever).x());
      shift.columns[1].values.push_back(stop.at(row.lever).y());
    }
    dataset.tables.push_back(std::move(shift));
  }
  return dataset;
}

TEST(StopsOfTableAndHead, AreInTheSdOfWhatFourPosesTell) {
  std::mt19937_64 random{81};
  Moments offset, stylus;
  for (int trial = 0; trial < 600; ++trial) {
    const Machine machine = randomMachine(random, 0.0);
    const double sigma = uniform(random, 2e-4, 5e-3);
    auto rows = grid({0.0}, kOpposed, kOpposed);
    for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, 0).head<2>();
    const auto solved =
        solve(measuredAtStops("spindle-offset-2x2", "", rows, sigma, {tableAboutX(sigma), headAboutY(sigma)}, random));
    ASSERT_TRUE(solved) << solved.error().reason;
    for (const std::size_t k : {0U, 1U}) {
      const auto at = static_cast<Eigen::Index>(k);
      offset.add(solved->find("offset_C_minus_A_mm")->values[k] - machine.c_point[at],
                 solved->find("offset_C_minus_A_mm")->sd[k]);
      stylus.add(solved->find("stylus_offset_mm")->values[k] - machine.stylus[at],
                 solved->find("stylus_offset_mm")->sd[k]);
    }
  }
  expectHonest(offset);
  expectHonest(stylus);
}

// A table that is off tilts the axis that it carries.
TEST(StopsOfTableAndHead, AreInTheSdOfATilt) {
  std::mt19937_64 random{82};
  Moments tilt;
  for (int trial = 0; trial < 600; ++trial) {
    Machine machine = randomMachine(random, 0.0);
    const double sigma = uniform(random, 2e-4, 5e-3);
    auto rows = grid({80, 120, 160}, kOpposed, kOpposed);
    for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, 0).head<2>();
    const auto solved = solve(measuredAtStops("c-axis-alignment", "z_mm", rows, sigma, {tableAboutX(sigma)}, random));
    ASSERT_TRUE(solved) << solved.error().reason;
    for (const std::size_t k : {0U, 1U})
      tilt.add(solved->find("C_tilt_rad")->values[k], solved->find("C_tilt_rad")->sd[k]);
  }
  expectHonest(tilt);
}

TEST(StopsOfTableAndHead, HaveLinesOfTheBudgetAndAreInTheCovariance) {
  std::mt19937_64 random{83};
  constexpr double kSigma = 1e-3;
  auto rows = grid({0.0}, kOpposed, kOpposed);
  const auto solved =
      solve(measuredAtStops("spindle-offset-2x2", "", rows, kSigma, {tableAboutX(kSigma), headAboutY(kSigma)}, random));
  ASSERT_TRUE(solved);
  const auto& offset = *solved->find("offset_C_minus_A_mm");
  // Four readings of one sigma, and the stop.
  EXPECT_NEAR(offset.sd[0], kSigma * std::hypot(0.5, 3.0), 1e-9);
  EXPECT_NEAR(offset.sd[1], kSigma * std::hypot(0.5, 2.0), 1e-9);
  ASSERT_EQ(solved->budget.size(), 3U);
  EXPECT_NEAR(solved->budget[0].sd[0], kSigma / 2, 1e-9) << "readings, type A";
  EXPECT_EQ(solved->budget[1].name, "stop_of_table");
  EXPECT_TRUE(solved->budget[1].type_b);
  EXPECT_NEAR(solved->budget[1].sd[1], 2 * kSigma, 1e-9);
  EXPECT_EQ(solved->budget[2].name, "stop_of_head");
  EXPECT_NEAR(solved->budget[2].sd[0], 3 * kSigma, 1e-9);
  const auto& covariance = *solved->covariance;
  const std::size_t n = covariance.components.size();
  std::size_t k = 0;
  for (const auto& estimate : solved->estimates) {
    for (std::size_t part = 0; part < estimate.sd.size(); ++part, ++k) {
      EXPECT_NEAR(std::sqrt(covariance.values[k * n + k]), estimate.sd[part], 1e-12) << covariance.components[k];
      EXPECT_NEAR(estimate.uncertainty[part], estimate.sd[part], 1e-12) << "counted once";
    }
  }
}

}  // namespace
}  // namespace probebox::metrology
