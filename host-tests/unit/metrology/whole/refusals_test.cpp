// Every refusal by its name, and that it says what to do.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using simulation::measure;
using simulation::Scene;

Dataset touches(const Scene& scene = {}) {
  std::mt19937_64 random{3};
  return measure(scene, random);
}

std::vector<double>& column(Dataset& dataset, std::string_view table, std::string_view name) {
  for (auto& candidate : dataset.tables) {
    if (candidate.name != table) continue;
    for (auto& entry : candidate.columns) {
      if (entry.name == name) return entry.values;
    }
  }
  throw std::out_of_range{std::string{name}};
}

Table& tableOf(Dataset& dataset, std::string_view name) {
  return *std::ranges::find(dataset.tables, name, &Table::name);
}

void eraseRows(Table& table, const std::function<bool(std::size_t)>& which) {
  const std::size_t rows = table.rows();
  for (auto& entry : table.columns) {
    std::vector<double> kept;
    for (std::size_t row = 0; row < rows; ++row) {
      if (!which(row)) kept.push_back(entry.values[row]);
    }
    entry.values = kept;
  }
}

void copyRow(Table& table, std::size_t row) {
  for (auto& entry : table.columns) {
    entry.values.insert(entry.values.begin() + static_cast<std::ptrdiff_t>(row), entry.values[row]);
  }
}

struct Damage {
  std::string refusal;
  std::function<void(Dataset&)> inflict;
};

class DamagedTouches : public testing::TestWithParam<Damage> {};

TEST_P(DamagedTouches, AreRefusedByName) {
  Dataset dataset = touches();
  GetParam().inflict(dataset);
  const auto solved = solve(dataset);
  ASSERT_FALSE(solved.ok());
  EXPECT_EQ(solved.error().name, GetParam().refusal) << solved.error().reason;
  EXPECT_GT(solved.error().reason.size(), 40U) << "a sentence with the remedy";
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Tables, DamagedTouches,
    testing::Values(
        Damage{"unknown-method", [](Dataset& d) { d.method = "delay-by-guessing"; }},
        Damage{"missing-table", [](Dataset& d) { d.tables.pop_back(); }},
        Damage{"missing-column", [](Dataset& d) { tableOf(d, "probe").columns.pop_back(); }},
        Damage{"unknown-column",
               [](Dataset& d) { tableOf(d, "probe").columns.push_back(tableOf(d, "probe").columns[2]); }},
        Damage{"ragged-table", [](Dataset& d) { column(d, "machine", "x_mm").pop_back(); }},
        Damage{"empty-table", [](Dataset& d) { eraseRows(tableOf(d, "machine"), [](std::size_t) { return true; }); }},
        Damage{"not-finite", [](Dataset& d) { column(d, "probe", "b")[100] = kNan; }},
        Damage{"not-finite", [](Dataset& d) { column(d, "machine", "t_s")[5] = 1.0 / 0.0; }},
        Damage{"duplicated-sample", [](Dataset& d) { copyRow(tableOf(d, "machine"), 40); }},
        Damage{"duplicated-sample",
               [](Dataset& d) {
                 // The whole table once more, below itself.
                 for (auto& entry : tableOf(d, "probe").columns) {
                   const std::vector<double> once = entry.values;
                   entry.values.insert(entry.values.end(), once.begin(), once.end());
                 }
               }},
        Damage{"time-not-rising",
               [](Dataset& d) { column(d, "probe", "t_s")[12] = 0.5 * column(d, "probe", "t_s")[11]; }},
        Damage{"single-speed",
               [](Dataset& d) {
                 const std::vector<double> speeds = column(d, "touches", "speed_mm_s");
                 eraseRows(tableOf(d, "touches"), [&](std::size_t row) { return speeds[row] != 20.0; });
               }},
        Damage{"duplicated-touch", [](Dataset& d) { copyRow(tableOf(d, "touches"), 3); }},
        Damage{"unknown-touch", [](Dataset& d) { column(d, "machine", "touch")[0] = 99.0; }},
        Damage{"missing-touch",
               [](Dataset& d) {
                 const auto& ids = column(d, "machine", "touch");
                 const std::vector<double> copy = ids;
                 eraseRows(tableOf(d, "machine"), [&](std::size_t row) { return copy[row] > 12.0; });
               }},
        Damage{"bad-direction", [](Dataset& d) { column(d, "touches", "nx")[0] = 0.5; }},
        Damage{"bad-direction", [](Dataset& d) { column(d, "touches", "ux")[0] = -1.0; }},
        Damage{"bad-speed", [](Dataset& d) { column(d, "touches", "speed_mm_s")[0] = -5.0; }},
        Damage{"bad-config", [](Dataset& d) { d.config["effective_diameter_mm"] = -1.0; }},
        Damage{"bad-config", [](Dataset& d) { d.config["effective_diameter_mm"] = std::string{"31"}; }},
        Damage{"truncated",
               [](Dataset& d) {
                 // The last fifteen hundredths of a second of the first touch are missing in both streams.
                 for (const auto* name : {"machine", "probe"}) {
                   const std::vector<double> ids = column(d, name, "touch");
                   const std::vector<double> times = column(d, name, "t_s");
                   eraseRows(tableOf(d, name), [&](std::size_t row) { return ids[row] == 0.0 && times[row] > 0.25; });
                 }
               }},
        Damage{"truncated",
               [](Dataset& d) {
                 const std::vector<double> ids = column(d, "machine", "touch");
                 const std::vector<double> times = column(d, "machine", "t_s");
                 eraseRows(tableOf(d, "machine"), [&](std::size_t row) { return ids[row] == 2.0 && times[row] > 0.3; });
               }},
        Damage{"duplicated-reading", [](Dataset& d) {
                 // Touch 24 becomes a copy of touch 23.
                 for (const auto* name : {"machine", "probe"}) {
                   Table& table = tableOf(d, name);
                   const std::vector<double> ids = column(d, name, "touch");
                   eraseRows(table, [&](std::size_t row) { return ids[row] == 24.0; });
                   const std::size_t rows = table.rows();
                   for (std::size_t row = 0; row < rows; ++row) {
                     if (table.columns[0].values[row] != 23.0) continue;
                     table.append({24.0, table.columns[1].values[row], table.columns[2].values[row],
                                   table.columns[3].values[row], table.columns[4].values[row]});
                   }
                 }
               }}));

struct BadSetUp {
  std::string refusal;
  std::function<void(Scene&)> change;
};

class BadSetUps : public testing::TestWithParam<BadSetUp> {};

TEST_P(BadSetUps, AreRefusedByName) {
  Scene scene;
  GetParam().change(scene);
  const auto solved = solve(touches(scene));
  ASSERT_FALSE(solved.ok());
  EXPECT_EQ(solved.error().name, GetParam().refusal) << solved.error().reason;
}

INSTANTIATE_TEST_SUITE_P(SetUps, BadSetUps,
                         testing::Values(BadSetUp{"single-speed", [](Scene& s) { s.speeds_mm_s = {25.0}; }},
                                         BadSetUp{"speeds-too-close",
                                                  [](Scene& s) {
                                                    s.speeds_mm_s = {25.0, 29.0};
                                                  }},
                                         BadSetUp{"one-sided",
                                                  [](Scene& s) {
                                                    s.normals = {{0, 0, 1}};
                                                  }},
                                         BadSetUp{"too-few-samples", [](Scene& s) { s.probe_rate_hz = 60.0; }},
                                         BadSetUp{"no-contact", [](Scene& s) {
                                                    s.overtravel_mm = 1e-9;
                                                    s.bounce_mm = 0.0;
                                                  }}));

// One bad touch among many is left out, by name.
TEST(BadTouch, IsDroppedAndNamed) {
  std::mt19937_64 random{4};
  const Scene scene;
  Dataset dataset = measure(scene, random);
  const std::vector<double> ids = column(dataset, "machine", "touch");
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (ids[row] == 7.0) column(dataset, "machine", "y_mm")[row] += 0.02;
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1U);
  EXPECT_EQ(solved->dropped[0].name, "touch 7");
  EXPECT_EQ(solved->dropped[0].reason, "residual-too-large");
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("touch 7")));
  EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 4.0 * *solved->find("tau_s")->standardDeviation());
}

void clip(Dataset& dataset, double touch, double limit) {
  const std::vector<double> ids = column(dataset, "probe", "touch");
  for (const auto* channel : {"a", "b", "c"}) {
    auto& values = column(dataset, "probe", channel);
    for (std::size_t row = 0; row < ids.size(); ++row) {
      if (ids[row] == touch || touch < 0.0) values[row] = std::clamp(values[row], -limit, limit);
    }
  }
}

TEST(BadTouch, IsDroppedWhenTheSensorClips) {
  std::mt19937_64 random{5};
  Dataset dataset = measure({}, random);
  clip(dataset, 11.0, 0.3);
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1U);
  EXPECT_EQ(solved->dropped[0].name, "touch 11");
  EXPECT_EQ(solved->dropped[0].reason, "clipped");
}

TEST(BadTouch, RefusesTheCaseWhenAllAreBad) {
  std::mt19937_64 random{6};
  Dataset dataset = measure({}, random);
  clip(dataset, -1.0, 0.3);
  EXPECT_EQ(solve(dataset).error().name, "clipped");
}

TEST(BadTouch, IsDroppedWhenTheFeedOverrideMoves) {
  std::mt19937_64 random{7};
  Dataset dataset = measure({}, random);
  const std::vector<double> ids = column(dataset, "machine", "touch");
  auto& times = column(dataset, "machine", "t_s");
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (ids[row] == 3.0) times[row] += 0.15 * times[row] * times[row];
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1U);
  EXPECT_EQ(solved->dropped[0].name, "touch 3");
  EXPECT_EQ(solved->dropped[0].reason, "speed-not-constant");
}

TEST(BadTouch, IsDroppedWhenTheStatedSpeedOrDirectionIsWrong) {
  std::mt19937_64 random{8};
  Dataset dataset = measure({}, random);
  column(dataset, "touches", "speed_mm_s")[6] = 16.0;
  for (const auto* axis : {"nx", "ux"}) column(dataset, "touches", axis)[10] = 0.8;
  for (const auto* axis : {"ny", "uy"}) column(dataset, "touches", axis)[10] = 0.6;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 2U);
  EXPECT_EQ(solved->dropped[0].reason, "speed-differs");
  EXPECT_EQ(solved->dropped[1].reason, "wrong-direction");
}

Dataset points(std::vector<std::array<double, 3>> rows) {
  constexpr std::array<std::string_view, 3> kNames{"x_mm", "y_mm", "z_mm"};
  Dataset dataset{
      .method = "sphere-fit", .config = {{"sigma_mm", 0.001}}, .tables = {Table::withColumns("points", kNames)}};
  for (const auto& row : rows) dataset.tables[0].append({row[0], row[1], row[2]});
  return dataset;
}

const std::vector<std::array<double, 3>> kGood{{10, 0, 0}, {-10, 0, 0}, {0, 10, 0}, {0, -10, 0}, {0, 0, 10}};

TEST(BadSphere, IsRefusedByName) {
  const auto refusal = [](const Dataset& dataset) { return solve(dataset).error().name; };
  ASSERT_TRUE(solve(points(kGood)).ok());
  EXPECT_EQ(refusal(points({})), "empty-table");
  EXPECT_EQ(refusal(points({{1, 2, 3}, {3, 2, 1}, {0, 0, 1}})), "too-few-readings");
  EXPECT_EQ(refusal(points({{10, 0, 0}, {-10, 0, 1e-3}, {0, 10, 0}, {0, -10, -1e-3}, {7.07, 7.07, 0}})), "coplanar");
  EXPECT_EQ(refusal(points({{10, 0, 0}, {-10, 0, 0}, {0, 10, 0}, {0, 10, 0}, {0, 0, 10}})), "duplicated-reading");
  EXPECT_EQ(refusal(points({{10, 0, 0}, {-10, 0, 0}, {0, 10, 0}, {0, kNan, 0}, {0, 0, 10}})), "not-finite");
  auto off = kGood;
  off[1][0] = -10.2;
  off.push_back({0, 6, 8});
  EXPECT_EQ(refusal(points(off)), "residual-too-large");
  Dataset limited = points(kGood);
  limited.config["radius_max_mm"] = 9.5;
  EXPECT_EQ(refusal(limited), "radius-out-of-limits");
  Dataset negative = points(kGood);
  negative.config["sigma_mm"] = -0.001;
  EXPECT_EQ(refusal(negative), "bad-config");
}

TEST(UnknownConfigKey, IsNotPassedOverInSilence) {
  Dataset dataset = points(kGood);
  dataset.config["sigma_um"] = 1.0;
  EXPECT_THAT(solve(dataset)->warnings, testing::ElementsAre(testing::HasSubstr("'sigma_um'")));
}

}  // namespace
}  // namespace probebox::metrology
