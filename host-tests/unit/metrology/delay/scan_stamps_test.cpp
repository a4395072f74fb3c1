// Scans with stamps of another clock, and with wild readings.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/scan_simulation.hpp"

namespace probebox::metrology {
namespace {

// A sample stamped early or late by what no loss of samples lasts: an answer would take memory for all the time
// between.
TEST(DelaySteppedScan, IsRefusedWhereAlmostAllOfItsTimeHasNoSamples) {
  std::mt19937_64 random{58};
  const Dataset good = simulation::measure(simulation::ScanScene{}, random);
  const double tau = tauOf(good);
  for (const double away_s : {-10.0, -3600.0, -1.7e9, 3600.0, 1.7e9}) {
    Dataset dataset = good;
    for (const auto* stream : {"machine", "probe"}) {
      auto& times = columnNamed(dataset, stream, "t_s");
      (away_s < 0 ? times.front() : times.back()) += away_s;
    }
    if (away_s == -10.0) {
      EXPECT_NEAR(tauOf(dataset), tau, 1e-6);
    } else {
      EXPECT_EQ(metrology::refusalOf(dataset), "gap") << away_s;
    }
  }
}

TEST(DelaySteppedScan, IsRefusedWhereTheProbesScansAreExchanged) {
  std::mt19937_64 random{59};
  std::uniform_real_distribution<double> delay_s{0.0, 0.006};
  for (int trial = 0; trial < 40; ++trial) {
    simulation::ScanScene scene;
    scene.tau_s = delay_s(random);
    Dataset dataset = simulation::measure(scene, random);
    for (auto& id : columnNamed(dataset, "probe", "scan")) id = id == 1.0 ? id : 2.0 - id;
    EXPECT_NE(metrology::refusalOf(dataset), "");
  }
}

// A reading of the wrong power of ten moves the place of the feature by millimetres, if it stays.
TEST(DelaySteppedScan, LeavesOutAWildReadingByName) {
  std::mt19937_64 random{58};
  const simulation::ScanScene scene;
  const Dataset good = simulation::measure(scene, random);
  for (const auto* column : {"x_mm", "y_mm", "z_mm"}) {
    for (const double factor : {10.0, -1.0, 25.4}) {
      SCOPED_TRACE(testing::Message() << column << " by " << factor);
      Dataset dataset = good;
      columnNamed(dataset, "machine", column)[900] *= factor;
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      const auto tau = solved->find("tau_s");
      EXPECT_LT(std::abs(tau->value() - scene.tau_s), 4.0 * *tau->standardDeviation());
      ASSERT_EQ(solved->dropped.size(), 1u);
      EXPECT_THAT(solved->dropped[0].name, testing::StartsWith("scan 0, machine at "));
    }
  }
}

}  // namespace
}  // namespace probebox::metrology
