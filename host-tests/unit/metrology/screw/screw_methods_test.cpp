// screw-calibration and screw-compensation against a screw that is heated, turned and read by a slow sensor.
#include <array>
#include <cmath>
#include <complex>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/live/screw_model.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/heated_screw.hpp"
#include "host-tests/support/runs.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using testing::AllOf;
using testing::Gt;
using testing::Lt;

TEST(ScrewCalibration, MeasuresTheFaceAloneWhereTheGainThatStaysIsStated) {
  std::mt19937_64 random{5};
  const Dataset both = calibration({}, {}, 0.1, random);
  Dataset face = both;
  face.tables.erase(face.tables.begin());
  EXPECT_EQ(solve(face).error().name, "missing-table");
  face.config["K"] = 1.02;
  face.config["axis"] = std::string{"X"};
  const auto solved = solve(face);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("K"), nullptr);
  EXPECT_EQ(solved->find("sector_table_um")->values, solve(both)->find("sector_table_um")->values);
  EXPECT_EQ(solved->find("sector_table_um")->sd, solve(both)->find("sector_table_um")->sd);
  EXPECT_TRUE(solved->warnings.empty());
  face.config["K"] = std::string{"-1"};
  EXPECT_EQ(solve(face).error().name, "bad-config");
  Dataset stated = both;
  stated.config["K"] = 1.02;
  EXPECT_NE(solve(stated)->find("K")->value(), 1.02) << "measured, not believed";
  EXPECT_FALSE(solve(stated)->warnings.empty()) << "the key was not used";
}

TEST(ScrewCalibration, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement gain;
  Judgement table;
  Judgement drift;
  for (int trial = 0; trial < 150; ++trial) {
    const Screw screw = randomScrew(random);
    const Rotation rotation{.sigma_um = uniform(random, 0.05, 0.5), .drift_um_s = uniform(random, -0.01, 0.01)};
    const double sigma_error = uniform(random, 0.05, 0.5);
    const Dataset dataset = calibration(screw, rotation, sigma_error, random);
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    double levers = 0.0;
    for (const double kelvin : {1.0, 2.5, 4.0, 5.5}) {
      for (const double share : {0.0, 0.3, 0.6, 0.85}) {
        levers += std::pow((share + 0.5 * screw.offset_mm / screw.length_mm) * screw.sensorUm(kelvin), 2);
      }
    }
    const auto& k = *solved->find("K");
    gain.add(k.value() - 1.0 / screw.sensor_share, k.sd[0], sigma_error / std::sqrt(levers));
    const auto& sectors = *solved->find("sector_table_um");
    const double n = static_cast<double>(screw.sectors);
    const double bound = rotation.sigma_um * std::sqrt((1.0 - 1.0 / n) * n / 3600.0);
    for (std::size_t sector = 0; sector < screw.sectors; ++sector) {
      table.add(sectors.values[sector] - screw.sectorMean(sector), sectors.sd[sector], bound);
    }
    drift.add(solved->find("drift_um_s")->value() - rotation.drift_um_s, solved->find("drift_um_s")->sd[0], 1.0);
  }
  EXPECT_GT(gain.efficiency(), 0.8);
  EXPECT_LT(std::abs(gain.pulls.bias()), 4.0);
  EXPECT_THAT(gain.pulls.pull(), AllOf(Gt(0.65), Lt(1.4))) << "an sd of Student's t with 15 degrees of freedom";
  EXPECT_GT(table.efficiency(), 0.9);
  EXPECT_THAT(table.pulls.pull(), AllOf(Gt(0.9), Lt(1.1)));
  expectHonest(drift.pulls);
}

// Four turns in 80 s, while the screw approaches its temperature: 0.03 um of bend beside 0.02 um of noise.
TEST(ScrewCalibration, TakesOutADriftThatSlackens) {
  std::mt19937_64 random{7};
  Moments table, ends, drift;
  for (int trial = 0; trial < 150; ++trial) {
    const Screw screw;
    const Rotation rotation{.period_s = 20,
                            .rate_hz = 20,
                            .seconds = 80,
                            .sigma_um = 0.02,
                            .drift_um_s = uniform(random, 0.01, 0.03),
                            .bend_um_s2 = -uniform(random, 1, 3) * 1e-5};
    const auto solved = solve(calibration(screw, rotation, 0.1, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& sectors = *solved->find("sector_table_um");
    for (std::size_t sector = 0; sector < screw.sectors; ++sector)
      table.add(sectors.values[sector] - screw.sectorMean(sector), sectors.sd[sector]);
    // A turn begins in sector 1.
    for (const std::size_t sector : {0U, 1U, 2U})
      ends.add(sectors.values[sector] - screw.sectorMean(sector), sectors.sd[sector]);
    drift.add(solved->find("drift_um_s")->value() - rotation.drift_um_s, solved->find("drift_um_s")->sd[0]);
  }
  expectHonest(table);
  expectHonest(ends);
  expectHonest(drift);
}

TEST(ScrewCalibration, IsExactWithoutNoise) {
  std::mt19937_64 random{2};
  for (std::uint64_t trial = 0; trial < runs(20); ++trial) {
    const Screw screw = randomScrew(random);
    const auto solved = solve(calibration(screw, {.rate_hz = 200.0, .sigma_um = 0.0}, 0.0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("K")->value(), 1.0 / screw.sensor_share, 1e-12);
    const auto& table = solved->find("sector_table_um")->values;
    double sum = 0.0;
    for (std::size_t sector = 0; sector < screw.sectors; ++sector) {
      EXPECT_NEAR(table[sector], screw.sectorMean(sector), 1e-3) << "um: a nanometre";
      sum += table[sector];
    }
    EXPECT_NEAR(sum, 0.0, 1e-12);
  }
}

// The axis counts upwards towards the fixed bearing, 700 mm of which its zero is away.
TEST(ScrewCalibration, KnowsWhereTheNutOfAReversedAxisIs) {
  std::mt19937_64 random{12};
  Dataset dataset = calibration({.length_mm = 820.0, .offset_mm = 60.0}, {}, 0.1, random);
  dataset.config["axis_reversed"] = true;
  dataset.config["orgoff_mm"] = 700.0;
  auto& positions = columnNamed(dataset, "gain_cal", "x_mm");
  for (double& x : positions) x = 640.0 - x;  // the same places on the screw
  for (double& error : columnNamed(dataset, "gain_cal", "error_um")) error = -error;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("K")->value(), 1.0 / Screw{}.sensor_share, 0.01);
  for (const double x : {-200.0, 900.0, 1500.0}) {
    positions[3] = x;
    EXPECT_EQ(refusalOf(dataset), "outside-screw") << x;
  }
}

struct SlowNoise {
  double white_um, slow_um;  // of the converter, of the sensor
  double keeps;              // of the latter, from sample to sample
};

// A sensor of 0.1 s that is read 60 times a second; slower ones below the white noise of a converter, which hides the
// correlation of neighbours and not that of a passage of a sector; white noise alone.
TEST(ScrewCalibration, KnowsThatReadingsOfASlowSensorAreNotIndependent) {
  for (const auto& [white_um, slow_um, keeps] :
       {SlowNoise{0, 0.2, 0.846}, SlowNoise{0.2, 0.1, 0.85}, SlowNoise{0.2, 0.16, 0.95}, SlowNoise{0.2, 0.1, 0.98},
        SlowNoise{0.2, 0, 0}}) {
    if (!runsAreComplete() && keeps != 0.95 && slow_um > 0) continue;  // one sensor that is slow, one that is not
    SCOPED_TRACE(testing::Message() << slow_um << " um, " << keeps);
    std::mt19937_64 random{13};
    Moments table, drift;
    int warned = 0;
    for (int trial = 0; trial < 100; ++trial) {
      const Screw screw;
      Dataset dataset = calibration(screw, {.sigma_um = white_um}, 0.1, random);
      double noise = gauss(random, slow_um);
      for (double& sensor : columnNamed(dataset, "sector_cal", "sensor_um")) {
        noise = keeps * noise + std::sqrt(1 - keeps * keeps) * gauss(random, slow_um);
        sensor += noise;
      }
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      warned += testing::Value(solved->warnings, testing::Contains(testing::HasSubstr("correlated"))) ? 1 : 0;
      const auto& sectors = *solved->find("sector_table_um");
      for (std::size_t sector = 0; sector < screw.sectors; ++sector)
        table.add(sectors.values[sector] - screw.sectorMean(sector), sectors.sd[sector]);
      drift.add(solved->find("drift_um_s")->value() - Rotation{}.drift_um_s, solved->find("drift_um_s")->sd[0]);
      EXPECT_NEAR(std::sqrt(solved->covariance->values.back()), solved->find("drift_um_s")->sd[0], 1e-9);
    }
    EXPECT_THAT(table.pull(), AllOf(Gt(0.85), Lt(1.15))) << "1.9 to 3.7 by neighbours alone, below white noise";
    EXPECT_THAT(drift.pull(), AllOf(Gt(0.7), Lt(1.6))) << "2.6 to 17 by neighbours alone";
    EXPECT_TRUE(slow_um > 0 ? warned > 95 : warned < 10) << warned;
  }
}

TEST(ScrewCalibration, GivesTheMeansOfTheWorkedExample) {
  std::mt19937_64 random{3};
  Screw screw;
  screw.sectors = 8;
  const auto solved = solve(calibration(screw, {.rate_hz = 200.0, .sigma_um = 0.0}, 0.0, random));
  const std::array<double, 8> printed{3.240705,  2.728851,  -0.295953, -2.698666,
                                      -2.606112, -1.435657, -0.338641, 1.405473};
  for (std::size_t k = 0; k < 8; ++k) EXPECT_NEAR(solved->find("sector_table_um")->values[k], printed[k], 1e-3);
}

TEST(ScrewCalibration, TakesASensorThatIsReadAtOneAngleASector) {
  std::mt19937_64 random{4};
  const Screw screw{.sectors = 12};
  const auto solved = solve(calibration(screw, {.period_s = 12.0, .rate_hz = 1.0, .seconds = 240.0}, 0.1, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->dof, 240U - 14U);
  EXPECT_NEAR(solved->find("sector_table_um")->values[2], screw.waviness(0.3 + kTurn * 2.0 / 12.0), 0.3);
}

TEST(ScrewCalibration, RefusesByName) {
  std::mt19937_64 random{5};
  const Screw screw;
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = calibration(screw, {}, 0.1, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  const auto phi = [](Dataset& d) { return columnNamed(d, "sector_cal", "phi_rad"); };
  EXPECT_EQ(refusal([&](Dataset& d) {
              const auto angles = phi(d);
              keepRows(tableNamed(d, "sector_cal"), [&](std::size_t k) { return sectorAt(angles[k], 24) != 7; });
            }),
            "empty-sector");
  EXPECT_EQ(refusal([&](Dataset& d) {
              const auto angles = phi(d);
              int kept = 0;
              keepRows(tableNamed(d, "sector_cal"),
                       [&](std::size_t k) { return sectorAt(angles[k], 24) != 7 || ++kept < 10; });
            }),
            "too-few-samples");
  EXPECT_EQ(refusal([](Dataset& d) { keepRows(tableNamed(d, "sector_cal"), [](std::size_t k) { return k < 1500; }); }),
            "too-few-turns");
  EXPECT_EQ(refusal([](Dataset& d) {
              for (double& ext : columnNamed(d, "gain_cal", "ext_um")) ext = 30.0 + 0.05 * ext;
            }),
            "extension-span-too-small");
  EXPECT_EQ(refusal([](Dataset& d) {
              const auto times = columnNamed(d, "sector_cal", "t_s");
              auto& sensor = columnNamed(d, "sector_cal", "sensor_um");
              for (std::size_t k = 0; k < times.size(); ++k) sensor[k] += 0.2 * times[k];
            }),
            "not-steady");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["sectors"] = 7.5; }), "bad-sectors");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["sectors"] = 1000.0; }), "bad-sectors");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("screw_length_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["screw_length_mm"] = 0.0; }), "implausible");
  EXPECT_EQ(refusal([](Dataset& d) { d.tables.pop_back(); }), "missing-table");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "gain_cal", "error_um")[3] = std::nan(""); }), "not-finite");
}

// A calibrated screw in use: what is left of the nut's shift once the answer is added.
TEST(ScrewCompensation, TakesAwayTheShiftOfAHeatedScrewAtLowAndAtHighSpeed) {
  std::mt19937_64 random{6};
  for (int trial = 0; trial < 20; ++trial) {
    Screw screw = randomScrew(random);
    screw.sectors = 24;
    constexpr double kTimeConstant = 0.15;
    Dataset dataset{.method = "screw-compensation",
                    .config = {{"screw_length_mm", screw.length_mm},
                               {"orgoff_mm", screw.offset_mm},
                               {"K", -1.0 / screw.sensor_share},
                               {"threshold_rpm", thresholdRpm(1, kTimeConstant)}},
                    .tables = {}};
    Table cycle = Table::withColumns("cycle", std::array<std::string_view, 4>{"x_mm", "phi_rad", "rpm", "sensor_um"});
    Table table = Table::withColumns("sector_table", std::array<std::string_view, 2>{"sector", "T_um"});
    for (std::size_t sector = 24; sector-- > 0;) table.append({static_cast<double>(sector), screw.sectorMean(sector)});
    std::vector<double> shifts;
    for (int row = 0; row < 40; ++row) {
      const double rpm = row % 2 == 0 ? uniform(random, 0.0, 4.0) : uniform(random, 2500.0, 3500.0);
      const double omega = rpm / 60.0 * kTurn;
      const double angle = uniform(random, 0.0, kTurn);
      const double x = uniform(random, 0.0, 0.9) * screw.length_mm - screw.offset_mm;
      const double kelvin = uniform(random, -1.0, 6.0);
      double wave = 0.0;  // through the lag of the sensor
      for (std::size_t h = 0; h < 2; ++h) {
        const double harmonic = static_cast<double>(h + 1);
        wave += (screw.face[h] * std::polar(1.0, harmonic * angle) /
                 std::complex<double>{1.0, harmonic * omega * kTimeConstant})
                    .real();
      }
      cycle.append({x, angle, rpm, screw.sensorUm(kelvin) + wave});
      shifts.push_back(screw.nutShiftUm(x, kelvin));
    }
    dataset.tables = {std::move(cycle), std::move(table)};
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& compensation = *solved->find("comp_um");
    EXPECT_TRUE(compensation.sd.empty());
    for (std::size_t row = 0; row < shifts.size(); ++row) {
      // A sector of 15 degrees, the lag of the slow sensor, and the ripple that a fast one lets through.
      EXPECT_NEAR(compensation.values[row] + shifts[row], 0.0, 1.4) << "row " << row;
    }
  }
}

TEST(ScrewCompensation, RefusesByName) {
  Dataset good{.method = "screw-compensation",
               .config = {{"screw_length_mm", 820.0}, {"orgoff_mm", 60.0}, {"K", -0.97}, {"threshold_rpm", 64.0}},
               .tables = {}};
  Table cycle = Table::withColumns("cycle", std::array<std::string_view, 4>{"x_mm", "phi_rad", "rpm", "sensor_um"});
  cycle.append({350.0, kTurn / 4, 5.0, 56.58});
  Table table = Table::withColumns("sector_table", std::array<std::string_view, 2>{"sector", "T_um"});
  table.append({0.0, 0.5});
  table.append({1.0, -0.5});
  good.tables = {cycle, table};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = good;
    damage(dataset);
    return refusalOf(dataset);
  };
  ASSERT_TRUE(solve(good).ok());
  EXPECT_NEAR(solve(good)->find("comp_um")->values[0], -27.4413 + 0.97 * 0.5 * 0.5, 1e-9) << "the middle of a sector";
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "sector_table", "sector")[1] = 0.0; }), "bad-sectors");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "sector_table", "sector")[1] = 2.0; }), "bad-sectors");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["extension_max_um"] = 50.0; }), "extension-out-of-limits");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("K"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "cycle", "rpm")[0] = std::nan(""); }), "not-finite");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "cycle", "x_mm")[0] = 3500.0; }), "outside-screw");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "cycle", "x_mm")[0] = -150.0; }), "outside-screw");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "cycle", "x_mm")[0] = 760.0; }), "") << "at its end";
  Dataset stated = good;
  stated.config["sigma_um"] = 0.2;
  EXPECT_NEAR(solve(stated)->find("comp_um")->sd[0], 0.97 * 0.5 * 0.2, 1e-12);
}

}  // namespace
}  // namespace probebox::metrology
