// Wild samples of a screw's sensor among those of its slow turns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

double faceUm(double angle) {
  return 3 * std::cos(angle - 0.4) + 0.8 * std::cos(2 * angle - 1.9);
}

// Six turns in a minute, 25 samples a second.
Dataset turnedScrew(double sigma_um, double digit_um, std::mt19937_64& random) {
  Dataset dataset{.method = "screw-calibration",
                  .config = {{"screw_length_mm", 820.0}, {"orgoff_mm", 60.0}, {"sectors", 24.0}},
                  .tables = {}};
  Table& gain = addTable(dataset, "gain_cal", {"x_mm", "ext_um", "error_um"});
  for (const double ext_um : {12.0, 24.0, 36.0}) {
    for (const double x_mm : {0.0, 300.0, 700.0})
      gain.append({x_mm, ext_um, (x_mm + 60) / 820 * ext_um + gauss(random, 0.1)});
  }
  Table& face = addTable(dataset, "sector_cal", {"t_s", "phi_rad", "sensor_um"});
  for (int k = 0; k < 1500; ++k) {
    const double angle = kTurn * k / 250 + 0.3;
    const double read_um = 12 + faceUm(angle) + gauss(random, sigma_um);
    face.append({k / 25.0, angle, std::round(read_um / digit_um) * digit_um});
  }
  return dataset;
}

TEST(SensorSpikes, AreLeftOutAndNamed) {
  std::mt19937_64 random{51};
  const Dataset clean = turnedScrew(0.2, 1e-6, random);
  const auto without = solve(clean);
  ASSERT_TRUE(without) << without.error().reason;
  Dataset dataset = clean;
  for (const std::size_t row : {40U, 44U, 900U}) columnNamed(dataset, "sector_cal", "sensor_um")[row] += 100;
  columnNamed(dataset, "sector_cal", "sensor_um")[1200] -= 3;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  std::vector<std::string> names;
  for (const auto& dropped : solved->dropped) names.push_back(dropped.name);
  EXPECT_THAT(names, testing::ElementsAre("sector_cal 41", "sector_cal 45", "sector_cal 901", "sector_cal 1201"));
  EXPECT_EQ(solved->dof + 4, without->dof);
  EXPECT_NEAR(solved->rms, 0.2, 0.02) << "of the samples in use";
  const auto &table = *solved->find("sector_table_um"), &of_clean = *without->find("sector_table_um");
  for (std::size_t k = 0; k < 24; ++k) {
    EXPECT_NEAR(table.values[k], of_clean.values[k], 0.02) << k;
    EXPECT_NEAR(table.sd[k], of_clean.sd[k], 0.1 * of_clean.sd[k]) << k;
  }
  EXPECT_THAT(solved->warnings, IsEmpty());
}

TEST(SensorSpikes, AreNotSeenInHonestSamples) {
  std::mt19937_64 random{52};
  int dropped = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const bool coarse = trial % 2 == 0;
    const auto solved = solve(turnedScrew(coarse ? 0.05 : 0.2, coarse ? 1.0 : 1e-6, random));
    ASSERT_TRUE(solved) << solved.error().reason;
    dropped += static_cast<int>(solved->dropped.size());
    EXPECT_THAT(solved->warnings, testing::Not(Contains(HasSubstr("4.5 deviations"))));
  }
  EXPECT_LE(dropped, 3) << "one sample of 150 000 is so far off by chance";
}

TEST(SensorSpikes, OfManySamplesAreSaidAndNoneIsLeftOut) {
  std::mt19937_64 random{53};
  Dataset dataset = turnedScrew(0.2, 1e-6, random);
  auto& sensor = columnNamed(dataset, "sector_cal", "sensor_um");
  for (std::size_t row = 7; row < sensor.size(); row += 20) sensor[row] += row % 40 == 7 ? 30 : -30;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  EXPECT_THAT(solved->dropped, IsEmpty());
  EXPECT_THAT(solved->warnings, Contains(HasSubstr("4.5")));
}

// Both parts of the answer are measured apart.
TEST(SensorSpikes, GainAndFaceHaveNoCovariance) {
  std::mt19937_64 random{54};
  Dataset dataset = turnedScrew(0.2, 1e-6, random);
  const auto both = solve(dataset);
  ASSERT_TRUE(both) << both.error().reason;
  dataset.tables.erase(dataset.tables.begin());
  dataset.config["K"] = 1.0;
  const auto face = solve(dataset);
  ASSERT_TRUE(face) << face.error().reason;
  ASSERT_TRUE(both->covariance && face->covariance);
  const std::size_t of = both->covariance->components.size(), n = of - 1;
  ASSERT_EQ(face->covariance->components.size(), n);
  const auto& values = both->covariance->values;
  EXPECT_NEAR(values[0], std::pow(both->find("K")->sd[0], 2), 1e-15);
  for (std::size_t i = 0; i < n; ++i) {
    EXPECT_EQ(values[i + 1], 0.0);
    EXPECT_EQ(values[(i + 1) * of], 0.0);
    for (std::size_t k = 0; k < n; ++k)
      EXPECT_EQ(values[(i + 1) * of + k + 1], face->covariance->values[i * n + k]) << i << ", " << k;
  }
}

}  // namespace
}  // namespace probebox::metrology
