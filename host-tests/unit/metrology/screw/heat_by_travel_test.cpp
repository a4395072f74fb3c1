// Screws that are warm where their nut strokes: told from an even one by likelihood, and better on other readings.
#include "firmware/metrology/screw/heat_by_travel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLength_mm = 700;

// A steel screw in cells: heat by the way of the nut, conduction along it, loss to the air.
class WarmScrew {
 public:
  explicit WarmScrew(bool even) {
    std::array<double, kCells> kelvin{};
    for (std::size_t s = 0; s < kDuration_s; ++s) {
      position_mm_.push_back(nutAt(static_cast<double>(s)));
      const double from = s == 0 ? position_mm_[0] : position_mm_[s - 1];
      const auto [low, high] = std::minmax(from, position_mm_[s]);
      std::array<double, kCells> next{};
      for (std::size_t k = 0; k < kCells; ++k) {
        const double begin = kCell_mm * static_cast<double>(k);
        const double way = even ? std::abs(position_mm_[s] - from) / kCells
                                : std::max(0.0, std::min(high, begin + kCell_mm) - std::max(low, begin));
        const double below = kelvin[k == 0 ? 0 : k - 1], above = kelvin[k + 1 == kCells ? k : k + 1];
        next[k] = kelvin[k] + kDiffusivity_mm2_s * (below + above - 2 * kelvin[k]) / (kCell_mm * kCell_mm) -
                  kelvin[k] / kLoss_s + 6e-4 * way;
      }
      kelvin = next;
      kelvin_.push_back(kelvin);
    }
  }

  // How far the nut is displaced, um; of the whole screw where the position is its length.
  double stretch_um(std::size_t second, double position_mm) const {
    double sum = 0;
    for (std::size_t k = 0; k < kCells; ++k)
      sum += kelvin_[second][k] * std::clamp(position_mm - kCell_mm * static_cast<double>(k), 0.0, kCell_mm);
    return 11.5e-3 * sum;
  }
  Table travel() const {
    Table table = Table::withColumns("travel", ColumnNames{"time_s", "x_mm"});
    for (std::size_t s = 0; s < kDuration_s; ++s) table.append({static_cast<double>(s), position_mm_[s]});
    return table;
  }
  // Errors of the nut at random times and places, with columns time_s, x_mm, ext_um, error_um.
  Table readings(std::size_t count, std::mt19937_64& random) const {
    Table table = Table::withColumns("gain_cal", ColumnNames{"time_s", "x_mm", "ext_um", "error_um"});
    for (std::size_t k = 0; k < count; ++k) {
      const auto second = static_cast<std::size_t>(uniform(random, 900, kDuration_s - 1.0));
      const double x = uniform(random, 60, 640);
      table.append({static_cast<double>(second), x, stretch_um(second, kLength_mm),
                    stretch_um(second, x) + gauss(random, kSigma_um)});
    }
    return table;
  }

  static constexpr double kSigma_um = 0.5;

 private:
  static constexpr std::size_t kCells = 35, kDuration_s = 12600;
  static constexpr double kCell_mm = kLength_mm / kCells, kDiffusivity_mm2_s = 14, kLoss_s = 2400;

  static double stroke(double s, double low, double high, double speed) {
    const double way = std::fmod(s * speed, 2 * (high - low));
    return low + std::min(way, 2 * (high - low) - way);
  }
  static double nutAt(double s) {
    if (s < 3600) return stroke(s, 100, 250, 37);
    if (s < 5400) return 400;
    if (s < 9000) return stroke(s, 400, 600, 53);
    return stroke(s, 50, 650, 11);
  }

  std::vector<double> position_mm_;
  std::vector<std::array<double, kCells>> kelvin_;
};

ScrewModel screw() {
  ScrewModel model;
  model.length_mm = kLength_mm;
  return model;
}

double squaresOfOne(const Table& table) {
  double hh = 0, he = 0, ee = 0;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    const double h = (*table.column("x_mm"))[k] / kLength_mm * (*table.column("ext_um"))[k];
    const double e = (*table.column("error_um"))[k];
    hh += h * h;
    he += h * e;
    ee += e * e;
  }
  return ee - he * he / hh;
}

// What is left beside the noise of the readings, um.
double leftOf(double squares, std::size_t count) {
  return std::sqrt(squares / static_cast<double>(count) - WarmScrew::kSigma_um * WarmScrew::kSigma_um);
}

struct Found {
  std::optional<TravelGain> gain;
  TravelHeat heat;
};

Found foundFrom(const WarmScrew& warm, const Table& table) {
  const auto travel = warm.travel();
  const TravelHeat heat{screw(), *travel.column("time_s"), *travel.column("x_mm")};
  return {gainByTravel(screw(), heat, *table.column("time_s"), *table.column("x_mm"), *table.column("ext_um"),
                       *table.column("error_um"), squaresOfOne(table)),
          heat};
}

TEST(HeatByTravel, ExplainsAScrewThatIsWarmWhereItWorks) {
  std::mt19937_64 random{3};
  const WarmScrew warm{false};
  const Table table = warm.readings(40, random), others = warm.readings(200, random);
  const auto [gain, heat] = foundFrom(warm, table);
  ASSERT_TRUE(gain);
  const auto shares = heat.sharesOf(gain->law, *others.column("time_s"), *others.column("x_mm"));
  double squares = 0;
  for (std::size_t k = 0; k < others.rows(); ++k) {
    const double ext = (*others.column("ext_um"))[k], lever = (*others.column("x_mm"))[k] / kLength_mm;
    squares += std::pow((*others.column("error_um"))[k] - (gain->even * lever + gain->travel * shares[k]) * ext, 2);
  }
  const double left = leftOf(squares, 200), of_one = leftOf(squaresOfOne(others), 200);
  EXPECT_LT(left, 0.5 * of_one);
  EXPECT_NEAR(gain->even + gain->travel, 1, 0.1);
  EXPECT_GT(gain->travel, 0.5);
}

TEST(HeatByTravel, IsNotUsedOfAnEvenScrew) {
  std::mt19937_64 random{4};
  const WarmScrew even{true};
  int used = 0;
  for (int trial = 0; trial < 20; ++trial) used += foundFrom(even, even.readings(40, random)).gain ? 1 : 0;
  EXPECT_EQ(used, 0);
}

// From a calibration to the cycle of another hour.
TEST(HeatByTravel, GoesFromCalibrationToCompensation) {
  std::mt19937_64 random{5};
  const WarmScrew warm{false};
  Dataset calibration{.method = "screw-calibration",
                      .config = {{"screw_length_mm", kLength_mm}, {"orgoff_mm", 0.0}, {"sectors", 4.0}},
                      .tables = {warm.readings(40, random), warm.travel()}};
  Table& face = addTable(calibration, "sector_cal", {"t_s", "phi_rad", "sensor_um"});
  for (int k = 0; k < 400; ++k) face.append({0.1 * k, 0.05 * k, gauss(random, 0.05)});
  const auto found = solve(calibration);
  ASSERT_TRUE(found.ok()) << found.error().reason;
  ASSERT_NE(found->find("travel_gain"), nullptr);
  EXPECT_LT(found->find("gain_by_travel_rms_um")->value(), found->find("gain_rms_um")->value());

  const Table others = warm.readings(100, random);
  Dataset compensation{.method = "screw-compensation",
                       .config = {{"screw_length_mm", kLength_mm},
                                  {"orgoff_mm", 0.0},
                                  {"threshold_rpm", 0.0},
                                  {"K", found->find("even_gain")->value()},
                                  {"travel_gain", found->find("travel_gain")->value()},
                                  {"time_constants_s", found->find("time_constants_s")->values},
                                  {"slow_heat_ratio", found->find("slow_heat_ratio")->value()}},
                       .tables = {warm.travel()}};
  Table& cycle = addTable(compensation, "cycle", {"x_mm", "phi_rad", "rpm", "sensor_um", "time_s"});
  for (std::size_t k = 0; k < others.rows(); ++k)
    cycle.append({(*others.column("x_mm"))[k], 0, 100, (*others.column("ext_um"))[k], (*others.column("time_s"))[k]});
  Table& sectors = addTable(compensation, "sector_table", {"sector", "T_um"});
  for (const double sector : {0.0, 1.0}) sectors.append({sector, 0.0});
  const auto compensated = solve(compensation);
  ASSERT_TRUE(compensated.ok()) << compensated.error().reason;
  double squares = 0;
  for (std::size_t k = 0; k < others.rows(); ++k)
    squares += std::pow(compensated->estimates[0].values[k] - (*others.column("error_um"))[k], 2);
  EXPECT_LT(leftOf(squares, 100), 0.6 * leftOf(squaresOfOne(others), 100));
  const double sd_gain = found->find("travel_gain")->sd.at(0);
  EXPECT_GT(sd_gain, 0);
  EXPECT_LT(sd_gain, 0.2 * std::abs(found->find("travel_gain")->value()));
  Dataset uncertain = compensation;
  uncertain.config["sigma_um"] = 0.01;
  const double of_sensor = solve(uncertain)->estimates[0].uncertainty.back();
  uncertain.config["sd_travel_gain"] = sd_gain;
  EXPECT_GT(solve(uncertain)->estimates[0].uncertainty.back(), 1.1 * of_sensor);
  Dataset still = compensation;
  still.tables.erase(still.tables.begin());
  EXPECT_EQ(solve(still).error().name, "missing-table") << "a gain by travel needs to know where the nut was";
  Dataset late = compensation;
  columnNamed(late, "cycle", "time_s").back() += 1e9;
  EXPECT_EQ(solve(late).error().name, "outside-travel");
  tableNamed(compensation, "cycle").columns.pop_back();
  EXPECT_EQ(solve(compensation).error().name, "missing-key");
}

}  // namespace
}  // namespace probebox::metrology
