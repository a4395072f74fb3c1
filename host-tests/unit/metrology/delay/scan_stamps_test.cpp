// Scans with stamps of another clock.
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

}  // namespace
}  // namespace probebox::metrology
