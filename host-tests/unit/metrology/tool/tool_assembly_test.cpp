// Tools against a measuring unit: machine coordinates at contact, worked out from where things are.
#include <Eigen/Core>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/setter_cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

TEST(ToolAssembly, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement judgement;
  for (int trial = 0; trial < 500; ++trial) {
    Assembly truth;
    truth.holder = uniform(random, 60, 100);
    truth.assembled = uniform(random, 20, 80);
    truth.tool = truth.holder + truth.assembled - uniform(random, -2, 2);
    truth.off = {uniform(random, -.2, .2), uniform(random, -.2, .2)};
    const int repetitions = 2 + trial % 5;
    const double sigma = uniform(random, 5e-4, 5e-3);
    const auto solved = solve(assemblyDataset(truth, repetitions, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const double bound = sigma / std::sqrt(2.0 * repetitions);
    const auto& length = *solved->find("assembled_length_mm");
    const auto& compensation = *solved->find("compensation_mm");
    judgement.add(length.value() - truth.assembled, length.sd[0], bound);
    judgement.add(compensation.values[0] - truth.off[0], compensation.sd[0], bound);
    judgement.add(compensation.values[1] - truth.off[1], compensation.sd[1], bound);
  }
  EXPECT_THAT(judgement.efficiency(), testing::AllOf(testing::Gt(0.9), testing::Lt(1.12)));
  EXPECT_THAT(judgement.pulls.pull(), testing::AllOf(testing::Gt(0.87), testing::Lt(1.14)))
      << "an sd of Student's t, 9 to 33";
  EXPECT_LT(std::abs(judgement.pulls.bias()), 4.0);
}

TEST(ToolAssembly, GivesTheWorkedExampleWithAndWithoutAWorkpiece) {
  for (const double variant : {0.0, 1.0}) {
    Dataset dataset{.method = "tool-assembly",
                    .config = {{"L1_mm", 85.0},
                               {"L2_mm", 142.5},
                               {"part_mm", std::vector<double>{0.0, 0.0, 25.0}},
                               {"sigma_mm", 0.002},
                               {"sd_L1_mm", 0.003}},
                    .tables = {}};
    stateExactMachine(dataset);
    addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"})
        .append({variant, 0.0, 0.0, 0.0, 145.2503 + 25.0 * variant});
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("assembled_length_mm")->value(), 60.2503, 1e-9);
    EXPECT_NEAR(solved->find("compensation_mm")->values[2], 2.7503, 1e-9);
    EXPECT_NEAR(solved->find("assembled_length_mm")->sd[0], std::hypot(0.002, 0.003), 1e-12);
    EXPECT_NEAR(solved->find("compensation_mm")->sd[2], 0.002, 1e-12) << "L1 is not part of it";
  }
}

Dataset storedDataset() {
  std::mt19937_64 random{9};
  const Assembly truth;
  Dataset dataset = assemblyDataset(truth, 3, 0.0, random);
  dataset.config["sigma_mm"] = 0.001;
  dataset.config.erase("L1_mm");
  dataset.config.erase("L2_mm");
  dataset.config["holder_id"] = 12.0;
  dataset.config["tool_id"] = 7.0;
  dataset.config["measured_at_s"] = 1.79e9;
  Table& holders = addTable(dataset, "holder_store", {"holder_id", "L1_mm", "sd_mm"});
  holders.append({11.0, 70.0, 0.0});
  holders.append({12.0, truth.holder, 0.003});
  addTable(dataset, "tool_store", {"tool_id", "L2_mm", "sd_mm"}).append({7.0, truth.tool, 0.002});
  return dataset;
}

// A readout of 1 um shows the same number three times.
TEST(ToolAssembly, IsNoMoreCertainThanItsReadoutShows) {
  Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 85.0}, {"L2_mm", 142.5}}, .tables = {}};
  stateExactMachine(dataset);
  Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
  for (const double rep : {1.0, 2.0, 3.0}) table.append({0.0, rep, -0.031, 0.042, 145.251});
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("assembled_length_mm")->sd[0], 0.001 / std::sqrt(12.0), 1e-6);
  EXPECT_NEAR(solved->find("compensation_mm")->sd[2], 0.001 / std::sqrt(12.0), 1e-6);
  EXPECT_NEAR(solved->find("gauge_length_mm")->sd[0], 0.001 / std::sqrt(12.0), 1e-6);
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("0.001 mm")));
  dataset.config["sigma_mm"] = 0.0005;
  EXPECT_NEAR(solve(dataset)->find("assembled_length_mm")->sd[0], 0.0005 / std::sqrt(3.0), 1e-6);
}

// Whatever the noise beside the digit: neither is an sd believed that the digits hide, nor are they counted twice.
TEST(ToolAssembly, IsAsUncertainAsItSaysWhereReadingsAreRounded) {
  std::mt19937_64 random{53};
  struct Noise {
    double sigma;
    double least_pull;  // how little noise below the digit averages is not known from so few readings
  };
  for (const auto [sigma, least_pull] : {Noise{0.0001, 0.4}, {0.0003, 0.22}, {0.0006, 0.5}, {0.002, 0.85}}) {
    Moments length;
    for (int trial = 0; trial < 1000; ++trial) {
      Assembly truth;
      truth.assembled = uniform(random, 20, 80);
      truth.tool = truth.holder + truth.assembled;
      truth.off = {uniform(random, -.2, .2), uniform(random, -.2, .2)};
      Dataset dataset = assemblyDataset(truth, 6, sigma, random);
      keepRows(dataset.tables[0], [](std::size_t row) { return row < 6; });
      for (const char* column : {"W0_x_mm", "W0_y_mm", "L0_z_mm"}) {
        for (double& value : columnNamed(dataset, "readings", column)) value = std::round(value * 1e3) / 1e3;
      }
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      const auto& found = *solved->find("assembled_length_mm");
      length.add(found.value() - truth.assembled, found.sd[0]);
    }
    EXPECT_THAT(length.pull(), testing::AllOf(testing::Gt(least_pull), testing::Lt(1.2))) << sigma;
  }
}

TEST(ToolAssembly, TakesLengthsFromTheStoresAndWritesTwoRecordsBack) {
  const auto solved = solve(storedDataset());
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const Assembly truth;
  const double l4 = truth.holder + truth.assembled - truth.tool;
  const auto near = [](double value) { return testing::DoubleNear(value, 1e-9); };
  EXPECT_THAT(solved->find("motion_control_mm")->values, testing::ElementsAre(near(-.03), near(.04), near(l4)));
  EXPECT_THAT(solved->find("simulation_mm")->values,
              testing::ElementsAre(near(-.03), near(.04), near(truth.assembled)));
  // Each with the sd of the length that it holds.
  const double touched = 0.001 / std::sqrt(6.0);
  EXPECT_NEAR(solved->find("motion_control_mm")->sd[2], std::hypot(touched, 0.002), 1e-9);
  EXPECT_NEAR(solved->find("simulation_mm")->sd[2], std::hypot(touched, 0.003), 1e-9);
  EXPECT_EQ(solved->find("holder_id")->value(), 12.0);
  EXPECT_EQ(solved->find("measured_at_s")->value(), 1.79e9);
}

// Whether a length comes from a store or from the case, its uncertainty is no reading.
TEST(ToolAssembly, HasTheBudgetOfTheSameLengthsInTheCase) {
  Dataset dataset = storedDataset();
  const auto stored = solve(dataset);
  for (const auto* store : {"holder_store", "tool_store"}) {
    std::erase_if(dataset.tables, [&](const Table& table) { return table.name == store; });
  }
  dataset.config["L1_mm"] = Assembly{}.holder;
  dataset.config["L2_mm"] = Assembly{}.tool;
  dataset.config["sd_L1_mm"] = 0.003;
  dataset.config["sd_L2_mm"] = 0.002;
  const auto stated = solve(dataset);
  ASSERT_TRUE(stored.ok() && stated.ok()) << stated.error().reason;
  ASSERT_EQ(stored->budget.size(), 3U);
  ASSERT_EQ(stated->budget.size(), 3U);
  EXPECT_NEAR(stored->budget[0].sd[0], 0.001 / std::sqrt(6.0), 1e-9) << "of the readings alone";
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(stored->budget[k].name, stated->budget[k].name);
    EXPECT_EQ(stored->budget[k].type_b, k > 0);
    EXPECT_THAT(stored->budget[k].sd, testing::Pointwise(testing::DoubleNear(1e-9), stated->budget[k].sd));
  }
}

TEST(ToolAssembly, RefusesStoresThatDoNotTell) {
  const auto refusal = [](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = storedDataset();
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["holder_id"] = 13.0; }), "missing-id");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("tool_id"); }), "missing-id");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "holder_store", "holder_id")[0] = 12.0; }), "duplicated-id");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["L1_mm"] = 80.0; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("measured_at_s"); }), "missing-key");
}

TEST(ToolAssembly, RefusesByName) {
  std::mt19937_64 random{2};
  const auto refusal = [&](const std::function<void(Dataset&)>& damage, const Assembly& truth = {}) {
    Dataset dataset = assemblyDataset(truth, 3, 0.001, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto lengths = [](Dataset& d) -> std::vector<double>& { return columnNamed(d, "readings", "L0_z_mm"); };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("L1_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("L2_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("part_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["tool_id"] = std::string{}; }), "missing-id");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["tool_id"] = std::string{"T7"}; }), "");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "readings", "workpiece_variant")[0] = 2.0; }), "bad-variant");
  EXPECT_EQ(refusal([&](Dataset& d) { lengths(d)[1] += 0.3; }), "spread-too-large");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["L1_mm"] = 146.0; }), "length-not-positive");
  EXPECT_EQ(refusal([&](Dataset& d) {
              for (double& length : lengths(d)) length -= 200.0;
            }),
            "length-not-positive");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["assembled_max_mm"] = 60.0; }), "length-too-large");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["L2_mm"] = 140.0; }), "compensation-too-large");
  EXPECT_EQ(refusal([](Dataset& d) {
              d.config["L2_mm"] = 140.0;
              d.config["compensation_limit_mm"] = 6.0;
            }),
            "");
  Dataset plain = assemblyDataset({}, 3, 0.001, random);
  keepRows(tableNamed(plain, "readings"), [](std::size_t row) { return row < 3; });
  plain.config.erase("part_mm");
  EXPECT_TRUE(solve(plain).ok()) << "nothing touched a workpiece";
}

TEST(ToolAssembly, KnowsOnWhichSideTheToolComes) {
  std::mt19937_64 random{21};
  Dataset from_above = assemblyDataset({}, 3, 0.001, random);
  Dataset from_below = from_above;
  for (double& length : columnNamed(from_below, "readings", "L0_z_mm")) length = -length;
  EXPECT_EQ(refusalOf(from_below), "spread-too-large") << "the workpiece adds where it should take off";
  from_below.config["approach_side"] = -1.0;
  const auto above = solve(from_above);
  const auto below = solve(from_below);
  ASSERT_TRUE(below.ok()) << below.error().reason;
  EXPECT_EQ(below->estimates, above->estimates);
  EXPECT_TRUE(below->warnings.empty());
  from_below.config["approach_side"] = 0.5;
  EXPECT_EQ(refusalOf(from_below), "bad-config");
}

TEST(ToolAssembly, RefusesAFaceThatWasNotMeant) {
  std::mt19937_64 random{22};
  Dataset dataset = assemblyDataset({}, 3, 0.001, random);
  Table& faces = addTable(dataset, "faces", {"axis", "touched", "configured"});
  faces.append({2, 1, 1});
  faces.append({1, 2, 2});
  EXPECT_EQ(refusalOf(dataset), "");
  columnNamed(dataset, "faces", "touched")[1] = 1;
  EXPECT_EQ(refusalOf(dataset), "wrong-face");
  EXPECT_THAT(solve(dataset).error().reason,
              testing::AllOf(testing::HasSubstr("Y axis"), testing::HasSubstr("face 1")));
  columnNamed(dataset, "faces", "axis")[1] = 3;
  EXPECT_EQ(refusalOf(dataset), "bad-face");
}

}  // namespace
}  // namespace probebox::metrology
