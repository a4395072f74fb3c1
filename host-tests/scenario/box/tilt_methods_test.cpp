#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"

// Methods that tilt the table under the part, run on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using world::operator*;
using world::operator+;
using world::operator-;

const std::uint64_t kTiltSeeds = runs(20);

// The table's axis somewhere else, leaning some other way.
world::Config tiltWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& table = *config.tilting_table;
  for (double& at : table.point_mm) at += within(0.05);
  table.direction = {1, within(5e-4), within(5e-4)};
  config.part_spindle.point_mm[1] += within(0.05);
  return config;
}

// Where the axis is in y and z, at that x, for positions of a stylus that hangs off its spindle's axis.
std::array<double, 2> pivotOf(const world::Config& config, double x_mm) {
  const auto& table = *config.tilting_table;
  const auto& stylus = config.probe_spindle.stylus_offset_mm;
  const world::Vector3 off{stylus[0], stylus[1], 0};
  const double along_mm = x_mm + off[0] - table.point_mm[0];
  const auto at = table.point_mm + (along_mm / table.direction[0]) * table.direction - off;
  return {at[1], at[2]};
}

double meanOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Judges a pivot by where the readings lie along the axis.
void judge(Pulls& pulls, const metrology::Result& result, const metrology::Dataset& dataset,
           const world::Config& config) {
  const auto truth = pivotOf(config, meanOf(*dataset.table("readings")->column("x_mm")));
  add(pulls, result, "pivot_yz_mm", {truth[0], truth[1]}, 1e-3);
}

TEST(LiveTablePivot, FindsTheAxisWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kTiltSeeds; ++seed) {
    const auto config = tiltWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kTablePivot);
    ASSERT_TRUE(result);
    judge(pulls, *result, scenario.dataset(), config);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(LiveTablePivot, FindsItFromOtherTiltsToo) {
  Pulls pulls;
  ProcedureOptions options{.b_count = 3, .b_axis = {1, 0, 0}};
  options.b_angles_rad = {-50 * kDegree, 0, 40 * kDegree};
  for (std::uint64_t seed = 1; seed <= kTiltSeeds; ++seed) {
    const auto config = tiltWorld(100 + seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kTablePivot, options);
    ASSERT_TRUE(result);
    judge(pulls, *result, scenario.dataset(), config);
  }
  pulls.expectHonest();
}

TEST(LiveTablePivot, ReadsTheBallAtEveryTiltAndLevelsTheTableAfterwards) {
  Scenario scenario{usualWorld(), 2};
  const auto result = measured(scenario, procedure::kTablePivot);
  ASSERT_TRUE(result);
  const auto& readings = *scenario.dataset().table("readings");
  EXPECT_THAT(*readings.column("tilt_deg"), testing::ElementsAre(-90, 0, -90, 0));
  EXPECT_THAT(*readings.column("C_deg"), testing::ElementsAre(0, 0, 180, 180));
  // 100 mm above the axis; of a level ball five sides are touched, of a tilted one four.
  for (const std::size_t tilted : {0U, 2U}) {
    EXPECT_NEAR(readings.column("y_mm")->at(tilted), 300, 0.3);
    EXPECT_NEAR(readings.column("z_mm")->at(tilted), -260, 0.3);
  }
  EXPECT_EQ(scenario.dataset().table("touches")->rows(), 18U);
  const auto& poses = *scenario.dataset().table("centres");
  EXPECT_NEAR(poses.column("B_rad")->at(0), -90 * kDegree, 1e-12);
  scenario.run(10s);
  EXPECT_EQ(scenario.controller().activity(), world::Activity::asking);
  EXPECT_EQ(scenario.machine().commandedPose().table_rad, 0);
}

TEST(LiveTablePivot, IsRefusedWithoutADelay) {
  Scenario scenario{usualWorld(), 4};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kTablePivot);
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "no-delay");
}

TEST(TiltingTable, IsLeveledForMethodsThatDoNotTiltIt) {
  Scenario scenario{usualWorld(), 5};
  ASSERT_TRUE(measured(scenario, procedure::kTablePivot));
  const auto solved = scenario.calibrate(procedure::kCentreline, {.angles = 3});
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_NEAR(scenario.dataset().table("centres")->column("z_mm")->at(0), -160, 0.05);
}

}  // namespace
}  // namespace probebox::scenario
