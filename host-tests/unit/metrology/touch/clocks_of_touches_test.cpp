// Clocks that run at other rates, and stamps that jump, in the record of a touch.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/stamp_jumps.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using testing::HasSubstr;

Dataset touchedBall(std::function<void(simulation::Scene&)> change = {}) {
  std::mt19937_64 random{41};
  auto scene = simulation::knownSphere();
  if (change) change(scene);
  return simulation::measure(scene, random);
}

Dataset byClock(Dataset dataset, std::string_view table, double rate) {
  for (auto& stamp : columnNamed(dataset, table, "t_s")) stamp *= rate;
  return dataset;
}

TEST(ClocksOfTouches, ThatRunAtDifferentRatesAreRefusedByNameWithTheRemedy) {
  for (const double rate : {1.1, 1.06}) {
    const auto solved = solve(byClock(touchedBall(), "probe", rate));
    ASSERT_FALSE(solved) << rate << ": " << solved->find("tau_s")->value();
    EXPECT_EQ(solved.error().name, "clocks-differ") << solved.error().reason;
    EXPECT_THAT(solved.error().reason, HasSubstr("one clock"));
  }
  std::mt19937_64 random{42};
  EXPECT_EQ(refusalOf(byClock(simulation::measure(simulation::perAxis(), random), "probe", 1.1)), "clocks-differ");
}

TEST(ClocksOfTouches, AreOneWhereTheStylusBouncesOrTheGainIsCoupled) {
  EXPECT_EQ(refusalOf(touchedBall([](auto& scene) { scene.bounce_mm = 0.1; })), "");
  EXPECT_EQ(refusalOf(touchedBall([](auto& scene) { scene.gain << 0.8, 0.2, 0.0, -0.2, 1.3, 0.1, 0.0, 0.0, 1.0; })),
            "");
  EXPECT_EQ(refusalOf(touchedBall([](auto& scene) { scene.machine_rate_hz = 200.0; })), "");
}

// A record that begins at rest in the surface says nothing of the way in.
TEST(ClocksOfTouches, AreTakenAsOneWithoutTheApproach) {
  Dataset dataset = byClock(touchedBall(), "probe", 1.0);
  const auto touches = readTouches(dataset).value();
  for (const char* const table : {"machine", "probe"}) {
    const auto ids = columnNamed(dataset, table, "touch");
    const auto stamps = columnNamed(dataset, table, "t_s");
    keepRows(tableNamed(dataset, table), [&](std::size_t row) {
      const auto& times = touches[static_cast<std::size_t>(ids[row])].machine.times;
      return stamps[row] > times.front() + 0.4 * (times.back() - times.front());
    });
  }
  EXPECT_EQ(refusalOf(dataset), "");
}

int warnedOfOwnDelays(const Dataset& dataset) {
  const auto solved = solve(dataset);
  if (!solved) return -1;
  return static_cast<int>(std::ranges::count_if(solved->warnings, [](const std::string& warning) {
    return warning.find("by their ways in and out their delays differ") != std::string::npos;
  }));
}

// One touch whose streams are shifted moves the centre by its own way, and the sizes agree all the same.
TEST(ClocksOfTouches, OfWhichOneIsShiftedAreWarnedOf) {
  std::mt19937_64 random{43};
  for (const auto& scene : {simulation::perAxis(), simulation::plates(), simulation::knownSphere()}) {
    const Dataset good = simulation::measure(scene, random);
    EXPECT_EQ(warnedOfOwnDelays(good), 0) << scene.method;
    for (const double by_s : {0.001, -0.001}) {
      Dataset dataset = good;
      auto& stamps = columnNamed(dataset, "machine", "t_s");
      const auto& ids = columnNamed(dataset, "machine", "touch");
      for (std::size_t row = 0; row < stamps.size(); ++row)
        if (ids[row] == 1.0) stamps[row] += by_s;
      EXPECT_NE(warnedOfOwnDelays(dataset), 0) << scene.method << " by " << by_s;
    }
  }
}

TEST(ClocksOfTouches, OfOneDelayAreNotWarnedOf) {
  const auto warned = [](auto change) { return warnedOfOwnDelays(touchedBall(change)); };
  EXPECT_EQ(warned([](auto& scene) { scene.bounce_mm = 0.1; }), 0);
  EXPECT_EQ(warned([](auto& scene) { scene.gain << 0.8, 0.2, 0.0, -0.2, 1.3, 0.1, 0.0, 0.0, 1.0; }), 0);
  EXPECT_EQ(warned([](auto& scene) { scene.machine_rate_hz = 200.0; }), 0);
  EXPECT_EQ(warned([](auto& scene) { scene.machine_resolution_mm = 0.005; }), 0);
  EXPECT_EQ(warned([](auto& scene) { scene.acceleration_mm_s2 = 3000.0; }), 0);
}

void jumpFrom(Touch& touch, std::size_t row, double by_s) {
  for (std::size_t k = row; k < touch.machine.times.size(); ++k) touch.machine.times[k] += by_s;
}

TEST(StampsOfATouch, ThatJumpAnywhereWhileItMovesAreRefused) {
  const auto good = readTouches(touchedBall()).value().front();
  ASSERT_TRUE(fitRetract(good, {}));
  const std::size_t rows = good.machine.times.size();
  for (const std::size_t row : {std::size_t{7}, std::size_t{10}, rows - 4, rows - 15, rows - 20}) {
    for (const double by_s : {0.002, 0.004, 0.02}) {
      auto touch = good;
      jumpFrom(touch, row, by_s);
      const auto retract = fitRetract(touch, {});
      ASSERT_FALSE(retract) << "row " << row << " of " << rows << " by " << by_s;
      EXPECT_EQ(retract.error().name, "stamps-jump") << retract.error().reason;
      EXPECT_THAT(retract.error().reason, HasSubstr("measure again"));
    }
  }
}

TEST(StampsOfATouch, GoOnAsTheyShouldWhereSamplesAreLost) {
  const auto good = readTouches(touchedBall()).value().front();
  const auto rows = static_cast<Eigen::Index>(good.machine.times.size());
  for (const Eigen::Index lost : {1, 3, 8, 15}) {
    for (Eigen::Index first = 0; first + lost < rows; ++first) {
      Touch touch = good;
      const auto at = touch.machine.times.begin() + first;
      touch.machine.times.erase(at, at + lost);
      touch.machine.values.resize(rows - lost, 3);
      touch.machine.values << good.machine.values.topRows(first), good.machine.values.bottomRows(rows - lost - first);
      const auto refusal = stampsJump(touch, 0.0);
      EXPECT_FALSE(refusal) << first << ", " << lost << ": " << refusal->reason;
    }
  }
}

TEST(StampsOfATouch, MayJitter) {
  for (const double jitter_s : {1e-4, 3e-4}) {
    const auto touches = readTouches(touchedBall([&](auto& scene) { scene.stamp_jitter_s = jitter_s; })).value();
    const auto found = stampJitter(touches);
    for (const auto& touch : touches) EXPECT_FALSE(stampsJump(touch, found.machine_s)) << touch.plan.name;
  }
}

}  // namespace
}  // namespace probebox::metrology
