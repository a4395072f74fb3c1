// Both streams by one clock of a wrong rate fit each other: the speed alone tells. And what else is wrong with the
// record of a drive in and out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/scan_simulation.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using testing::HasSubstr;

Dataset byWrongClock(Dataset dataset, double rate) {
  for (const char* const table : {"machine", "probe"})
    for (auto& stamp : columnNamed(dataset, table, "t_s")) stamp *= rate;
  return dataset;
}

Dataset drivenInAndOut() {
  std::mt19937_64 random{51};
  auto dataset = simulation::measure(simulation::inOut(), random);
  dataset.config.clear();
  return dataset;
}

Dataset scannedInSteps() {
  std::mt19937_64 random{52};
  return simulation::measure(simulation::ScanScene{}, random);
}

TEST(ClockRate, IsToldByTheSpeedOfADriveInAndOut) {
  EXPECT_EQ(refusalOf(byWrongClock(drivenInAndOut(), 0.9)), "");
  for (const double rate : {0.5, 0.8, 1.5}) {
    const auto solved = solve(byWrongClock(drivenInAndOut(), rate));
    ASSERT_FALSE(solved) << rate;
    EXPECT_EQ(solved.error().name, "speed-differs");
    EXPECT_THAT(solved.error().reason, HasSubstr("time stamps"));
  }
}

TEST(ClockRate, IsToldByTheSpeedOfAScan) {
  EXPECT_EQ(refusalOf(byWrongClock(scannedInSteps(), 0.9)), "");
  for (const double rate : {0.5, 0.8, 1.5}) {
    const auto solved = solve(byWrongClock(scannedInSteps(), rate));
    ASSERT_FALSE(solved) << rate;
    EXPECT_EQ(solved.error().name, "speed-differs");
    EXPECT_THAT(solved.error().reason, HasSubstr("time stamps"));
  }
}

TEST(DriveInAndOut, IsRefusedWhereTheMachinesStampsJump) {
  auto dataset = drivenInAndOut();
  auto& stamps = columnNamed(dataset, "machine", "t_s");
  for (std::size_t row = 7; row < stamps.size(); ++row) stamps[row] += 0.02;
  EXPECT_EQ(refusalOf(dataset), "stamps-jump");
}

TEST(DriveInAndOut, IsRefusedWhereTheFreeProbeDoesNotReadZero) {
  for (const double off : {0.2, 0.01, -0.05}) {
    auto dataset = drivenInAndOut();
    for (auto& value : columnNamed(dataset, "probe", "b")) value += off;
    EXPECT_EQ(refusalOf(dataset), "probe-not-at-zero") << off;
  }
}

// What is left after the wild readings fits: the refusal says how many they are, not that what is left differs.
TEST(DriveInAndOut, SaysHowManyReadingsDifferWhereTheyAreTooMany) {
  int refused = 0;
  for (std::size_t row = 20; row < 40; ++row) {
    auto dataset = drivenInAndOut();
    columnNamed(dataset, "machine", "x_mm")[row] += 0.02;
    const auto solved = solve(dataset);
    if (solved || solved.error().reason.find("where their noise explains") != std::string::npos) continue;
    EXPECT_EQ(solved.error().name, "residual-too-large") << solved.error().reason;
    EXPECT_THAT(solved.error().reason, HasSubstr("than 10"));
    ++refused;
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace probebox::metrology
