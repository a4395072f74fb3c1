// Tools against a setting device: machine coordinates at contact, worked out from where things are.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/methods.hpp"
#include "host-tests/metrology/setter_cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

TEST(ToolSetter, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{3};
  Judgement tool;
  Judgement device;
  for (int trial = 0; trial < 500; ++trial) {
    Setter setter;
    setter.at = {uniform(random, -200, 200), uniform(random, -200, 200), uniform(random, -200, 200)};
    setter.tool = {uniform(random, -5, 5), uniform(random, -5, 5), uniform(random, 80, 150)};
    const double sigma = uniform(random, 5e-4, 5e-3);
    const int repetitions = 1 + trial % 3;
    const auto solved = solve(setterDataset(setter, repetitions, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const double bound = sigma / std::sqrt(repetitions);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      tool.add(solved->find("tool_offset_mm")->values[k] - setter.tool[at], solved->find("tool_offset_mm")->sd[k],
               bound * std::numbers::sqrt2);
      device.add(solved->find("setter_mm")->values[k] - setter.at[at], solved->find("setter_mm")->sd[k], bound);
    }
  }
  expectHonest(tool);
  expectHonest(device);
}

TEST(ToolSetter, AddsTheUncertaintyOfTheProbeAndNoticesAMovedDevice) {
  std::mt19937_64 random{4};
  const Setter setter;
  Dataset dataset = setterDataset(setter, 1, 0.0, random);
  dataset.config["sigma_mm"] = 0.003;
  dataset.config["sd_probe_offset_mm"] = 0.004;
  const auto solved = solve(dataset);
  EXPECT_NEAR(solved->find("setter_mm")->sd[1], 0.005, 1e-12);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(solved->find("tool_offset_mm")->values[k], setter.tool[static_cast<Eigen::Index>(k)], 1e-9);
  }
  dataset.config["accepted_setter_mm"] = std::vector<double>{-193.0, 23.0, 17.05};
  dataset.config["setter_limit_mm"] = 0.04;
  EXPECT_EQ(refusalOf(dataset), "setter-moved");
  dataset.config["setter_limit_mm"] = 0.06;
  EXPECT_EQ(refusalOf(dataset), "");
}

// accepted_mm of machine.toml has the Y at which the device stands, and the readings have none.
TEST(ToolSetter, NoticesAMovedDeviceInThePlaneOfALathe) {
  std::mt19937_64 random{5};
  const Setter setter;
  Dataset dataset = faceDataset(setter, 0.0, random);
  const std::vector<double> along_y = *dataset.table("touches")->column("ny");
  keepRows(dataset.tables.front(), [&](std::size_t row) { return along_y[row] == 0; });
  dataset.config["sigma_mm"] = 0.001;
  dataset.config["machine_axes"] = std::string{"XZ"};
  dataset.config["centreline_mm"] = std::vector<double>{-1, 0};
  dataset.config["accepted_setter_mm"] = std::vector<double>{-193.0, 23.0, 17.05};
  dataset.config["accepted_link_mm"] = std::vector<double>{-192.05, 23.0};
  dataset.config["setter_limit_mm"] = 0.06;
  ASSERT_EQ(refusalOf(dataset), "");
  const auto solved = solve(dataset);
  EXPECT_NEAR(solved->find("setter_x_mm")->value(), -193, 1e-9);
  dataset.config["setter_limit_mm"] = 0.04;
  EXPECT_EQ(refusalOf(dataset), "setter-moved");
  dataset.config["accepted_setter_mm"] = std::vector<double>{-193.0, 23.0, 17.0};
  EXPECT_EQ(refusalOf(dataset), "setter-moved") << "by the link";
  dataset.config["accepted_link_mm"] = std::vector<double>{-192, 23.0};
  EXPECT_EQ(refusalOf(dataset), "");
}

TEST(ToolSetter, TakesHalfWidthsAndRadiiOffFaceByFace) {
  std::mt19937_64 random{23};
  Moments tool;
  Moments device;
  for (int trial = 0; trial < 300; ++trial) {
    Setter setter;
    setter.tool = {uniform(random, -5, 5), uniform(random, -5, 5), uniform(random, 80, 150)};
    const double sigma = trial == 0 ? 0.0 : 0.002;
    Dataset dataset = faceDataset(setter, sigma, random);
    dataset.config["sigma_mm"] = 0.002;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double error = solved->find("tool_offset_mm")->values[k] - setter.tool[at];
      if (trial > 0) {
        tool.add(error, solved->find("tool_offset_mm")->sd[k]);
        device.add(solved->find("setter_mm")->values[k] - setter.at[at], solved->find("setter_mm")->sd[k]);
      } else {
        EXPECT_NEAR(error, 0.0, 1e-9);
      }
    }
    if (trial > 0) continue;
    EXPECT_NEAR(solved->find("setter_mm")->sd[1], 0.002, 1e-12) << "one face tells y";
  }
  expectHonest(tool);
  expectHonest(device);
  EXPECT_LT(std::abs(tool.bias()), 4.0);
}

// A readout of 1 um shows the same numbers at every repeat.
TEST(ToolSetter, TakesTheStylusBallOffTheReadingsOfTheProbeAlongZ) {
  std::mt19937_64 random{9};
  const Setter setter;
  Dataset dataset = setterDataset(setter, 2, 1e-3, random);
  const auto without = solve(dataset);
  constexpr double kRadius_mm = 3, kSd_mm = 2e-3;
  auto& readings = dataset.tables.front();
  const auto flags = *readings.column("is_tool");
  auto& z = std::ranges::find(readings.columns, "z_mm", &Column::name)->values;
  for (std::size_t row = 0; row < z.size(); ++row) z[row] += flags[row] == 0 ? kRadius_mm : 0;
  dataset.config["stylus_ball_radius_mm"] = kRadius_mm;
  dataset.config["sd_stylus_ball_radius_mm"] = kSd_mm;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved && without);
  for (const char* key : {"tool_offset_mm", "setter_mm"}) {
    const auto& found = *solved->find(key);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.values[k], without->find(key)->values[k], 1e-9) << key;
      EXPECT_NEAR(found.uncertainty[k], std::hypot(found.sd[k], k == 2 ? kSd_mm : 0), 1e-9) << key;
    }
  }
}

TEST(ToolSetter, IsNoMoreCertainThanItsReadoutShows) {
  std::mt19937_64 random{16};
  Dataset dataset = faceDataset({.at = {-193.0123, 23.0234, 17.0345}}, 0.0, random);
  dataset.config.erase("sigma_mm");
  Table& touches = dataset.tables[0];
  for (const char* column : {"x_mm", "y_mm", "z_mm"}) {
    for (double& value : columnNamed(dataset, "touches", column)) value = std::round(value * 1e3) / 1e3;
  }
  keepRows(touches, [](std::size_t row) { return row % 5 != 4 && row % 5 != 1; });  // one face an axis
  for (auto& column : touches.columns) {
    const auto once = column.values;
    for (int repeat = 0; repeat < 2; ++repeat) column.values.insert(column.values.end(), once.begin(), once.end());
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  for (const double sd : solved->find("setter_mm")->sd) EXPECT_NEAR(sd, 0.001 / std::sqrt(12.0), 1e-6);
  for (const double sd : solved->find("tool_offset_mm")->sd) EXPECT_NEAR(sd, 0.001 / std::sqrt(6.0), 1e-6);
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("0.001 mm")));
}

// As people write them.
TEST(ToolSetter, TakesNormalsOfThreeDigits) {
  std::mt19937_64 random{14};
  const Setter setter;
  Dataset dataset = faceDataset(setter, 1e-9, random);
  for (const char* column : {"nx", "nz"}) {
    for (double& part : columnNamed(dataset, "touches", column)) part = std::round(part * 1e3) / 1e3;
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto& offset = *solved->find("tool_offset_mm");
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(offset.values[k], setter.tool[static_cast<Eigen::Index>(k)], 1e-6);
}

// A control reports where B stopped.
TEST(ToolSetter, TakesAnglesOfBAsTheyAreRead) {
  std::mt19937_64 random{15};
  const Setter setter;
  Dataset dataset = setterDataset(setter, 3, 0.001, random);
  dataset.config.erase("probe_offset_mm");
  Column b{"B_deg", {}};
  for (std::size_t row = 0; row < dataset.tables[0].rows(); ++row)
    b.values.push_back(45.0 + 1e-4 * static_cast<double>(row));
  dataset.tables[0].columns.push_back(b);
  Table& offsets = addTable(dataset, "probe_offsets", {"B_deg", "x_mm", "y_mm", "z_mm"});
  offsets.append({45.0, setter.probe.x(), setter.probe.y(), setter.probe.z()});
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("B_deg")->values.size(), 1U);
  EXPECT_NEAR(solved->find("tool_offset_mm")->values[2], setter.tool.z(), 0.005);
}

TEST(ToolSetter, RefusesFacesThatOnlyOneOfThemTouched) {
  std::mt19937_64 random{24};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = faceDataset({}, 0.001, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keep = [](const std::function<bool(std::size_t)>& which) {
    return [which](Dataset& d) { keepRows(tableNamed(d, "touches"), which); };
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal(keep([](std::size_t row) { return row != 9; })), "faces-differ");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "touches", "half_width_mm")[6] = 11.0; }), "faces-differ");
  EXPECT_EQ(refusal(keep([](std::size_t row) { return row % 5 != 2; })), "missing-face");
  EXPECT_EQ(refusal(keep([](std::size_t row) { return row < 5; })), "tool-not-measured");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "touches", "nx")[0] = 0.5; }), "bad-direction");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "touches", "radius_mm")[0] = -1.0; }), "bad-config");
}

TEST(ToolSetter, RefusesByName) {
  std::mt19937_64 random{5};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = setterDataset({}, 2, 0.001, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("probe_offset_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["probe_offset_mm"] = std::vector<double>{1.0, 2.0}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "readings", "is_tool")[0] = 0.5; }), "bad-flag");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "readings", "is_tool") = {0, 0, 0, 0}; }), "tool-not-measured");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "readings", "is_tool") = {1, 1, 1, 1}; }), "probe-not-measured");
}

// Of the results of one case, only the place of the device is relative to the turning axis.
TEST(ToolSetter, RestsOnTheCentrelineWithThePlaceOfTheDeviceAlone) {
  const auto subjects = subjectsOf({.method = "tool-setter", .config = {{"tool", 4.0}}, .tables = {}});
  ASSERT_EQ(subjects.size(), 2U);
  EXPECT_EQ(subjects[0].name, "tool-4");
  ASSERT_EQ(subjects[0].independent_of.size(), 1U);
  EXPECT_EQ(subjects[0].independent_of[0].name, "centreline_result");
  EXPECT_EQ(subjects[1].name, "setter");
  EXPECT_TRUE(subjects[1].independent_of.empty());
}

}  // namespace
}  // namespace probebox::metrology
