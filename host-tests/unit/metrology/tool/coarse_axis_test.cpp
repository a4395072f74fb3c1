// Tools of which one axis is read in fewer digits than the others, no sigma stated.
#include <Eigen/Core>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string_view>

#include "host-tests/metrology/setter_cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;

constexpr int kTrials = 300;
constexpr double kNoise_mm = 5e-4, kCoarse_mm = 0.01;

void coarsen(Dataset& dataset, std::string_view table, std::string_view column) {
  for (double& value : columnNamed(dataset, table, column)) value = std::round(value / kCoarse_mm) * kCoarse_mm;
}

struct Pulls {
  Moments coarse, fine;

  void add(const Estimate& found, const Vector3d& truth, Eigen::Index coarse_axis) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      (axis == coarse_axis ? coarse : fine).add(found.values[k] - truth[axis], found.sd[k]);
    }
  }
  void expectHonest() const {
    // Too wide where the coarse readings alternate: all axes share one scatter.
    EXPECT_THAT(coarse.pull(), AllOf(Gt(0.55), Lt(1.25)));
    EXPECT_THAT(fine.pull(), AllOf(Gt(0.7), Lt(1.25)));
  }
};

TEST(CoarseAxis, OfAnAssemblyHasTheSdOfItsDigits) {
  constexpr std::array<std::string_view, 3> kColumns{"W0_x_mm", "W0_y_mm", "L0_z_mm"};
  std::mt19937_64 random{61};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto coarse = kColumns[static_cast<std::size_t>(axis)];
    Pulls pulls;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3d truth{uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1), uniform(random, 0.5, 1.5)};
      Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 90.0}, {"L2_mm", 134.0}}, .tables = {}};
      Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", kColumns[0], kColumns[1], kColumns[2]});
      for (double rep = 0; rep < 5; ++rep) {
        table.append({0.0, rep, truth.x() + gauss(random, kNoise_mm), truth.y() + gauss(random, kNoise_mm),
                      134.0 + truth.z() + gauss(random, kNoise_mm)});
      }
      coarsen(dataset, "readings", coarse);
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      pulls.add(*solved->find("compensation_mm"), truth, axis);
      EXPECT_THAT(solved->warnings, testing::Contains(HasSubstr("the readings of " + std::string{coarse} + " have")));
    }
    SCOPED_TRACE(coarse);
    pulls.expectHonest();
  }
}

// readings: of the device's centre, or of its faces.
void expectHonestSetter(bool of_faces) {
  constexpr std::array<std::string_view, 3> kColumns{"x_mm", "y_mm", "z_mm"};
  std::mt19937_64 random{62};
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Pulls pulls;
    for (int trial = 0; trial < kTrials; ++trial) {
      Setter setter;
      setter.at = anywhere(random, 200);
      setter.tool += anywhere(random, 1);
      Dataset dataset = setterDataset(setter, 5, kNoise_mm, random);
      if (of_faces) {
        dataset = faceDataset(setter, kNoise_mm, random);
        Table& touches = dataset.tables[0];
        for (int repeat = 1; repeat < 5; ++repeat) {
          const Dataset again = faceDataset(setter, kNoise_mm, random);
          for (std::size_t k = 0; k < touches.columns.size(); ++k) {
            const auto& values = again.tables[0].columns[k].values;
            touches.columns[k].values.insert(touches.columns[k].values.end(), values.begin(), values.end());
          }
        }
        keepRows(touches, [](std::size_t row) { return row % 5 != 4 && row % 5 != 1; });  // one face an axis
      }
      dataset.config.erase("sigma_mm");
      coarsen(dataset, dataset.tables[0].name, kColumns[static_cast<std::size_t>(axis)]);
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      pulls.add(*solved->find("tool_offset_mm"), setter.tool, axis);
      EXPECT_THAT(solved->warnings, testing::Contains(HasSubstr("of 0.")));
    }
    SCOPED_TRACE(axis);
    pulls.expectHonest();
  }
}

TEST(CoarseAxis, OfCentresOfASettingDeviceHasTheSdOfItsDigits) {
  expectHonestSetter(false);
}

TEST(CoarseAxis, OfFacesOfASettingDeviceHasTheSdOfItsDigits) {
  expectHonestSetter(true);
}

// All axes are shown to 0.1 mm, or to whole millimetres.
TEST(CoarseAxis, OfAControlThatShowsFewDigitsHasTheSdOfThose) {
  std::mt19937_64 random{64};
  for (const double digit : {0.1, 1.0}) {
    Moments length;
    for (int trial = 0; trial < kTrials; ++trial) {
      const double truth = 135 + uniform(random, -1, 1);
      Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 90.0}, {"L2_mm", 134.0}}, .tables = {}};
      Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
      const auto shown = [&](double value) { return std::round((value + gauss(random, kNoise_mm)) / digit) * digit; };
      const double x = uniform(random, 2, 4), y = uniform(random, -4, -2);
      for (double rep = 0; rep < 5; ++rep) table.append({0.0, rep, shown(x), shown(y), shown(truth)});
      const auto solved = solve(dataset);
      if (!solved.ok()) {
        EXPECT_EQ(solved.error().name, "spread-too-large") << "between two digits";
        continue;
      }
      length.add(solved->find("assembled_length_mm")->value() - truth + 90, solved->find("assembled_length_mm")->sd[0]);
      EXPECT_THAT(solved->warnings, testing::Contains(HasSubstr("digits of")));
    }
    EXPECT_GT(length.count, 200U);
    EXPECT_THAT(length.pull(), AllOf(Gt(0.75), Lt(1.25))) << digit;
  }
}

// The height alone was measured, and the table wants three columns.
TEST(CoarseAxis, OfZerosDoesNotMakeTheOthersMoreCertain) {
  std::mt19937_64 random{63};
  Moments height;
  for (int trial = 0; trial < kTrials; ++trial) {
    Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 90.0}, {"L2_mm", 134.0}}, .tables = {}};
    Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
    for (double rep = 0; rep < 10; ++rep) table.append({0.0, rep, 0.0, 0.0, 135.1 + gauss(random, kNoise_mm)});
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    height.add(solved->find("assembled_length_mm")->value() - 45.1, solved->find("assembled_length_mm")->sd[0]);
    const auto& gauge = *solved->find("gauge_length_mm");
    EXPECT_NEAR(gauge.sd[0], solved->find("assembled_length_mm")->sd[0], 1e-12);
  }
  EXPECT_THAT(height.pull(), AllOf(Gt(0.75), Lt(1.4)));
}

// Three heights to 0.01 mm are 135.50 by chance once in ten times: zeros beside them are no further sign of 0.1 mm.
TEST(CoarseAxis, OfZerosDoesNotMakeTheOthersCoarser) {
  Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 90.0}, {"L2_mm", 134.0}}, .tables = {}};
  Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
  for (double rep = 0; rep < 3; ++rep) table.append({0.0, rep, 0.0, 0.0, 135.5});
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("assembled_length_mm")->sd[0], 0.01 / std::sqrt(12.0), 1e-4);
}

}  // namespace
}  // namespace probebox::metrology
