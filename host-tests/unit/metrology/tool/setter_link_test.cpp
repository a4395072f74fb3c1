// The setting device against the turning axis, and at several angles of the swivel.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/metrology/setter_cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The turning axis, and a probe on a head that swivels: its tip and the tool's hang elsewhere at every B, and the
// machine, out of square, sees the device elsewhere too.
struct MillTurn {
  Setter setter;
  Vector2d axis{0.154, -0.1105};  // at axis_z
  double axis_z{155.0};
  Vector2d tilt{2e-4, -1.5e-4};
  double squareness{4e-4};

  Vector2d link(const Vector3d& device) const { return device.head<2>() - axis - tilt * (device.z() - axis_z); }
  Vector3d tip(const Vector3d& level, double b_deg) const {
    return Eigen::AngleAxisd{b_deg * std::numbers::pi / 180.0, Vector3d::UnitY()} * level;
  }
  // Where the machine believes the reference to be while a tip is at the device.
  Vector3d reading(const Vector3d& tip) const {
    const Vector3d m = setter.at - tip;
    return m + Vector3d{squareness * m.z(), 0.0, 0.0};
  }
};

void stateAxis(Dataset& dataset, const MillTurn& machine) {
  dataset.config["centreline_mm"] = std::vector<double>{machine.axis.x(), machine.axis.y()};
  dataset.config["centreline_z_mm"] = machine.axis_z;
  dataset.config["C_tilt_rad"] = std::vector<double>{machine.tilt.x(), machine.tilt.y()};
}

Dataset swivelledDataset(const MillTurn& machine, const std::vector<double>& angles_deg, int repetitions, double sigma,
                         std::mt19937_64& random) {
  Dataset dataset{.method = "tool-setter", .config = {{"sigma_mm", sigma}}, .tables = {}};
  stateExactMachine(dataset);
  Table offsets = Table::withColumns("probe_offsets", std::vector<std::string_view>{"B_deg", "x_mm", "y_mm", "z_mm"});
  Table& table = addTable(dataset, "readings", {"is_tool", "x_mm", "y_mm", "z_mm", "B_deg"});
  for (const double b : angles_deg) {
    const Vector3d probe = machine.tip(machine.setter.probe, b);
    offsets.append({b, probe.x(), probe.y(), probe.z()});
    for (int rep = 0; rep < repetitions; ++rep) {
      for (const double is_tool : {0.0, 1.0}) {
        const Vector3d m = machine.reading(machine.tip(is_tool == 1.0 ? machine.setter.tool : machine.setter.probe, b));
        table.append(
            {is_tool, m.x() + gauss(random, sigma), m.y() + gauss(random, sigma), m.z() + gauss(random, sigma), b});
      }
    }
  }
  dataset.tables.push_back(std::move(offsets));
  return dataset;
}

TEST(SetterLink, LinksTheDeviceToTheTurningAxisAtItsHeight) {
  std::mt19937_64 random{31};
  Dataset dataset = setterDataset({}, 1, 0.0, random);
  stateAxis(dataset, {});
  dataset.config["sigma_mm"] = 0.001;
  dataset.config["sd_centreline_mm"] = 0.002;
  dataset.config["sd_C_tilt_rad"] = 2e-5;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  // The device is at (-193, 23, 17), 138 mm below where the axis was measured.
  EXPECT_NEAR(solved->find("link_mm")->values[0], -193.0 - 0.154 + 138.0 * 2e-4, 1e-9);
  EXPECT_NEAR(solved->find("link_mm")->values[1], 23.0 + 0.1105 - 138.0 * 1.5e-4, 1e-9);
  EXPECT_NEAR(solved->find("link_mm")->sd[0], std::hypot(0.001, 0.002, 138.0 * 2e-5), 1e-9);
  // The readings of this test are in whole millimetres.
  EXPECT_THAT(solved->warnings, testing::Each(testing::AnyOf(testing::HasSubstr("digits of 1 mm"),
                                                             testing::StartsWith("no-redundancy"))));
  ASSERT_EQ(solved->budget.size(), 3U);
  EXPECT_NEAR(solved->budget[0].sd[6], 0.001, 1e-9) << "of the readings alone";
  // By budget and by the sd that holds it already.
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(solved->find("link_mm")->uncertainty[k], solved->find("link_mm")->sd[k], 1e-9);
  }
}

TEST(SetterLink, StatesTheUncertaintyOfTheLink) {
  std::mt19937_64 random{32};
  Moments pulls;
  for (int trial = 0; trial < 300; ++trial) {
    MillTurn machine;
    machine.setter.at = {uniform(random, -200, 200), uniform(random, -200, 200), uniform(random, -200, 200)};
    const double sigma = uniform(random, 5e-4, 5e-3);
    Dataset dataset = setterDataset(machine.setter, 1 + trial % 3, sigma, random);
    const Vector2d truth = machine.link(machine.setter.at);
    const double sd_offset = 0.001;
    const double sd_axis = uniform(random, 5e-4, 3e-3);
    const double sd_tilt = uniform(random, 5e-6, 3e-5);
    auto& offset = std::get<std::vector<double>>(dataset.config["probe_offset_mm"]);
    for (double& part : offset) part += gauss(random, sd_offset);
    machine.axis += Vector2d{gauss(random, sd_axis), gauss(random, sd_axis)};
    machine.tilt += Vector2d{gauss(random, sd_tilt), gauss(random, sd_tilt)};
    stateAxis(dataset, machine);
    dataset.config["sd_probe_offset_mm"] = sd_offset;
    dataset.config["sd_centreline_mm"] = sd_axis;
    dataset.config["sd_C_tilt_rad"] = sd_tilt;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 2; ++k) {
      pulls.add(solved->find("link_mm")->values[k] - truth[static_cast<Eigen::Index>(k)],
                solved->find("link_mm")->sd[k]);
    }
  }
  expectHonest(pulls);
  EXPECT_LT(std::abs(pulls.bias()), 4.0);
}

TEST(SetterLink, NoticesThatDeviceAndTurningAxisMovedApart) {
  std::mt19937_64 random{33};
  MillTurn machine;
  Dataset dataset = setterDataset(machine.setter, 2, 0.0, random);
  stateAxis(dataset, machine);
  const Vector2d link = machine.link(machine.setter.at);
  dataset.config["sigma_mm"] = 0.001;
  dataset.config["accepted_setter_mm"] = std::vector<double>{-193.0, 23.0, 17.0};
  dataset.config["accepted_link_mm"] = std::vector<double>{link.x(), link.y()};
  dataset.config["setter_limit_mm"] = 0.04;
  EXPECT_EQ(refusalOf(dataset), "");
  machine.axis.x() += 0.05;
  stateAxis(dataset, machine);
  EXPECT_EQ(refusalOf(dataset), "setter-moved") << "the device stands still, the axis does not";
  dataset.config["setter_limit_mm"] = 0.06;
  EXPECT_EQ(refusalOf(dataset), "");
}

TEST(SetterLink, TakesSeveralSwivelAnglesTogetherAndEachByItself) {
  std::mt19937_64 random{34};
  MillTurn machine;
  const std::vector<double> angles_deg{0.0, 45.0, 90.0};
  Dataset dataset = swivelledDataset(machine, {90.0, 0.0, 45.0}, 2, 0.002, random);
  stateAxis(dataset, machine);
  dataset.config["sd_probe_offset_mm"] = 0.003;
  dataset.config["sd_centreline_mm"] = 0.002;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("B_deg")->values, angles_deg);
  for (std::size_t k = 0; k < angles_deg.size(); ++k) {
    Dataset alone = dataset;
    const auto& b = *dataset.table("readings")->column("B_deg");
    keepRows(tableNamed(alone, "readings"), [&](std::size_t row) { return b[row] == angles_deg[k]; });
    std::erase_if(tableNamed(alone, "readings").columns, [](const Column& column) { return column.name == "B_deg"; });
    const Vector3d probe = machine.tip(machine.setter.probe, angles_deg[k]);
    alone.config["probe_offset_mm"] = std::vector<double>{probe.x(), probe.y(), probe.z()};
    std::erase_if(alone.tables, [](const Table& table) { return table.name == "probe_offsets"; });
    const auto single = solve(alone);
    ASSERT_TRUE(single.ok()) << single.error().reason;
    for (const char* key : {"tool_offset_mm", "setter_mm", "link_mm"}) {
      const auto& one = *single->find(key);
      for (std::size_t i = 0; i < one.values.size(); ++i) {
        EXPECT_NEAR(solved->find(key)->values[k * one.values.size() + i], one.values[i], 1e-9) << key;
        EXPECT_NEAR(solved->find(key)->sd[k * one.values.size() + i], one.sd[i], 1e-9) << key;
        EXPECT_NEAR(solved->find(key)->uncertainty[k * one.values.size() + i], one.uncertainty[i], 1e-9) << key;
      }
    }
  }
}

// A wrong squareness is in probe and tool alike: the offset places the edge on the device, whatever the machine shows.
TEST(SetterLink, PutsTheEdgeOnTheDeviceAtEveryAngleThoughTheMachineIsOutOfSquare) {
  std::mt19937_64 random{35};
  const MillTurn machine;
  Dataset dataset = swivelledDataset(machine, {0.0, 90.0}, 1, 0.0, random);
  dataset.config["sigma_mm"] = 0.001;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto row = [&](const char* key, Eigen::Index k) -> Vector3d {
    return Vector3d::Map(solved->find(key)->values.data() + 3 * k);
  };
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Vector3d tool = machine.tip(machine.setter.tool, k == 0 ? 0.0 : 90.0);
    EXPECT_LT((machine.reading(tool) + row("tool_offset_mm", k) - row("setter_mm", k)).norm(), 1e-9);
    EXPECT_GT((row("tool_offset_mm", k) - tool).norm(), k == 0 ? 0.02 : 4e-4) << "not the physical offset";
  }
  EXPECT_GT((row("setter_mm", 0) - row("setter_mm", 1)).norm(), 0.05) << "each B has a place of its own";
}

TEST(SetterLink, PoolsTheScatterOfAllAnglesWhereNoSigmaIsStated) {
  std::mt19937_64 random{36};
  Moments pulls;
  for (int trial = 0; trial < 300; ++trial) {
    MillTurn machine;
    machine.squareness = 0.0;
    Dataset dataset = swivelledDataset(machine, {0.0, 30.0, 60.0, 90.0}, 3, 0.002, random);
    dataset.config.erase("sigma_mm");
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_EQ(solved->dof, 48U);
    const auto& offsets = *solved->find("tool_offset_mm");
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector3d truth = machine.tip(machine.setter.tool, 30.0 * static_cast<double>(k));
      for (std::size_t i = 0; i < 3; ++i) {
        pulls.add(offsets.values[3 * k + i] - truth[static_cast<Eigen::Index>(i)], offsets.sd[3 * k + i]);
      }
    }
  }
  expectHonest(pulls);
}

TEST(SetterLink, TouchesFacesAtEverySwivelAngle) {
  std::mt19937_64 random{37};
  const Setter setter;
  Dataset dataset = faceDataset(setter, 0.0, random);
  Dataset tilted = faceDataset(setter, 0.0, random);
  Table& table = tableNamed(dataset, "touches");
  const std::size_t rows = table.rows();
  for (std::size_t k = 0; k < table.columns.size(); ++k) {
    const auto& more = tilted.tables[0].columns[k].values;
    table.columns[k].values.insert(table.columns[k].values.end(), more.begin(), more.end());
  }
  table.columns.push_back({"B_deg", std::vector<double>(rows, 0.0)});
  table.columns.back().values.resize(2 * rows, 45.0);
  dataset.config.erase("probe_offset_mm");
  Table& offsets = addTable(dataset, "probe_offsets", {"B_deg", "x_mm", "y_mm", "z_mm"});
  for (const double b : {0.0, 45.0}) offsets.append({b, setter.probe.x(), setter.probe.y(), setter.probe.z()});
  dataset.config["sigma_mm"] = 0.001;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(solved->find("tool_offset_mm")->values[k], setter.tool[static_cast<Eigen::Index>(k % 3)], 1e-9);
  }
  // The tool's last face is touched at the other B only.
  columnNamed(dataset, "touches", "B_deg")[rows - 1] = 45.0;
  EXPECT_EQ(refusalOf(dataset), "faces-differ");
}

TEST(SetterLink, RefusesAxesAndAnglesThatDoNotFit) {
  std::mt19937_64 random{38};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = swivelledDataset({}, {0.0, 90.0}, 2, 0.001, random);
    stateAxis(dataset, {});
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["probe_offset_mm"] = std::vector<double>{0, 0, 200}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.tables.pop_back(); }), "missing-table");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "probe_offsets", "B_deg")[1] = 0.0; }), "duplicated-angle");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "probe_offsets", "B_deg")[1] = 89.0; }), "missing-orientation");
  EXPECT_EQ(refusal([](Dataset& d) {
              columnNamed(d, "readings", "is_tool")[4] = 1.0;
              columnNamed(d, "readings", "is_tool")[6] = 1.0;
            }),
            "probe-not-measured");
  EXPECT_EQ(refusal([](Dataset& d) {
              auto& b = columnNamed(d, "readings", "B_deg");
              b[5] = b[7] = 0.0;
            }),
            "tool-not-measured");
  EXPECT_EQ(refusal([](Dataset& d) {
              d.config["accepted_setter_mm"] = Matrix(3, {0, 0, 0});
              d.config["setter_limit_mm"] = 1.0;
            }),
            "bad-config")
      << "a row each B";
  // Three numbers are the place at the first B.
  const auto accepted = [](Dataset& d, double off_mm) {
    auto place = solve(d)->find("setter_mm")->values;
    place.resize(3);
    place[1] += off_mm;
    d.config["accepted_setter_mm"] = place;
    d.config["setter_limit_mm"] = 0.01;
  };
  EXPECT_EQ(refusal([&](Dataset& d) { accepted(d, 0); }), "");
  EXPECT_EQ(refusal([&](Dataset& d) { accepted(d, 0.02); }), "setter-moved");
  EXPECT_EQ(refusal([](Dataset& d) {
              d.config["accepted_setter_mm"] = Matrix{{-193, 23, 17}, {-193, 23, 17}};
              d.config["setter_limit_mm"] = 0.01;
            }),
            "setter-moved");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("centreline_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("centreline_z_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("C_tilt_rad"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) {
              d.config["accepted_link_mm"] = Matrix{{1, 2}, {1, 2}};
            }),
            "missing-key")
      << "without a limit";
  EXPECT_EQ(refusal([](Dataset& d) { d.config["centreline_mm"] = std::vector<double>{1.0}; }), "bad-config");
  std::vector<double> many;
  for (int k = 0; k < 21; ++k) many.push_back(k);
  EXPECT_EQ(refusalOf(swivelledDataset({}, many, 1, 0.001, random)), "too-many-angles");
  many.pop_back();
  EXPECT_EQ(refusalOf(swivelledDataset({}, many, 1, 0.001, random)), "");
}

}  // namespace
}  // namespace probebox::metrology
