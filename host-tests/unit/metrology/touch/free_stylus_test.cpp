// A stylus that is off the surface has to read zero: the separation is where the deflection is zero.
#include "firmware/metrology/touch/free_stylus.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/touch/retract.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using testing::HasSubstr;

// Adds to a channel of the probe in touches from a number on.
Dataset withZero(Dataset dataset, std::string_view channel, double off, double first_touch = 0) {
  const auto ids = columnNamed(dataset, "probe", "touch");
  auto& values = columnNamed(dataset, "probe", channel);
  for (std::size_t row = 0; row < ids.size(); ++row) values[row] += ids[row] >= first_touch ? off : 0.0;
  return dataset;
}

Dataset knownBall(const simulation::Scene& scene = simulation::knownSphere()) {
  std::mt19937_64 random{31};
  return simulation::measure(scene, random);
}

TEST(FreeStylus, ThatDoesNotReadZeroIsRefusedByNameWithTheRemedy) {
  for (const double off : {0.05, -0.05, 0.003}) {
    for (const char* const channel : {"a", "b", "c"}) {
      const auto solved = solve(withZero(knownBall(), channel, off));
      ASSERT_FALSE(solved) << channel << " " << off;
      EXPECT_EQ(solved.error().name, "probe-not-at-zero") << solved.error().reason;
      EXPECT_THAT(solved.error().reason, HasSubstr(std::string{"channel '"} + channel + "'"));
      EXPECT_THAT(solved.error().reason, HasSubstr("its zero"));
    }
  }
  std::mt19937_64 random{32};
  EXPECT_EQ(refusalOf(withZero(simulation::measure(simulation::plates(), random), "a", 0.05)), "probe-not-at-zero");
}

TEST(FreeStylus, ThatDoesNotReadZeroLeavesOutItsTouchAlone) {
  std::mt19937_64 random{33};
  auto good = simulation::measure(simulation::Scene{}, random);
  const auto last = columnNamed(good, "probe", "touch").back();
  const auto solved = solve(withZero(good, "b", 0.02, last));
  ASSERT_TRUE(solved) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1);
  EXPECT_EQ(solved->dropped.front().reason, "probe-not-at-zero");
}

TEST(FreeStylus, MayDriftByLessThanAMicrometre) {
  for (const double off : {0.0008, -0.0008}) {
    EXPECT_EQ(refusalOf(withZero(knownBall(), "a", off)), "");
  }
}

// 3 um are less than a step of 5 um, and are read as a whole one throughout.
TEST(FreeStylus, MayReadOneStepOfItsConverter) {
  auto touch = readTouches(knownBall()).value().front();
  for (auto& value : touch.probe.values.reshaped()) value = std::round((value + 0.003) / 0.005) * 0.005;
  const auto retract = fitRetract(touch, {});
  EXPECT_TRUE(retract) << retract.error().reason;
}

// Slower than the rest of the record lasts, and fast.
TEST(FreeStylus, MayRingAfterItHasParted) {
  auto touch = readTouches(knownBall()).value().front();
  const auto clean = fitRetract(touch, {});
  ASSERT_TRUE(clean);
  const double parted = separationTime(clean->probe);
  for (const double hertz : {12.0, 40.0, 160.0}) {
    auto ringing = touch;
    for (std::size_t k = 0; k < touch.probe.times.size(); ++k) {
      const double since = touch.probe.times[k] - parted;
      if (since <= 0.0) continue;
      ringing.probe.values.row(static_cast<Eigen::Index>(k)).array() +=
          0.010 * std::exp(-since / 0.03) * std::sin(2.0 * std::numbers::pi * hertz * since);
    }
    const auto retract = fitRetract(ringing, {});
    EXPECT_TRUE(retract) << hertz << " Hz: " << retract.error().reason;
  }
}

TEST(FreeStylus, IsLookedAtBeforeTheContactWhereTheRecordEndsBehindIt) {
  auto touch = readTouches(withZero(knownBall(), "a", 0.02)).value().front();
  const auto& times = touch.probe.times;
  const Parting parting{.at_s = times.back() - 0.002, .fall_s = 0.02, .units_per_mm = 1.0};
  const auto refusal = notAtZero(touch, parting);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->name, "probe-not-at-zero");
  EXPECT_FALSE(notAtZero(readTouches(knownBall()).value().front(), parting));
}

}  // namespace
}  // namespace probebox::metrology
