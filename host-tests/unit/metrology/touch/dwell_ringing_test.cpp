// A stylus that still rings from its contact, against the same touches of one that does not.
#include "firmware/metrology/touch/dwell_ringing.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/touch/touch.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using simulation::Scene;

// As drawn from one seed: bounce changes nothing but the deflection.
std::vector<Touch> touchesOf(const Scene& scene) {
  std::mt19937_64 random{17};
  return readTouches(simulation::measure(scene, random)).value();
}

// Largest deviation between the deflections of the retract, from half of the overtravel on, mm.
double farthest(const std::vector<Touch>& a, const std::vector<Touch>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::VectorXd size = b[i].probe.values.rowwise().norm();
    Eigen::Index last = size.size() - 1;
    while (size[last] < 0.02) --last;
    for (; size[last] < 0.4 * size.maxCoeff(); --last) {
      most = std::max(most, (a[i].probe.values.row(last) - b[i].probe.values.row(last)).norm());
    }
  }
  return most;
}

TEST(Ringing, IsTakenOutOfTheRetractAtEverySpeedAndRate) {
  for (const double rate : {800.0, 1000.0, 3000.0}) {
    Scene ringing = simulation::withoutNoise(Scene{.probe_rate_hz = rate, .speeds_mm_s = {10, 40}});
    ringing.overtravel_mm = 0.6;
    Scene quiet = ringing;
    quiet.bounce_mm = 0.0;
    const auto still = touchesOf(quiet);
    const auto raw = touchesOf(ringing);
    EXPECT_GT(farthest(raw, still), 5e-5);
    EXPECT_LT(farthest(withoutRinging(raw), still), 2e-7) << rate;
  }
}

// However long the rest, and however many samples it has: the work does not grow with them.
TEST(Ringing, IsOverByTheEndOfALongRest) {
  Scene slow{.probe_rate_hz = 20'000, .speeds_mm_s = {10}};
  slow.dwell_s = 2;
  const auto touches = touchesOf(slow);
  const auto same = withoutRinging(touches);
  ASSERT_EQ(same.size(), touches.size());
  Scene quiet = slow;
  quiet.bounce_mm = 0;
  EXPECT_LT(farthest(same, touchesOf(quiet)), 2e-4) << "the noise of both, and nothing taken out that is not there";
}

TEST(Ringing, LeavesWhatDoesNotRingAsItIs) {
  for (const double acceleration : {20000.0, 3000.0}) {
    for (const double rate : {1000.0, 5000.0}) {
      const Scene quiet{.machine_rate_hz = 0.5 * rate,
                        .probe_rate_hz = rate,
                        .bounce_mm = 0.0,
                        .clearance_mm = 1.0,
                        .acceleration_mm_s2 = acceleration};
      for (const Scene& scene : {quiet, simulation::withoutNoise(quiet)}) {
        const auto touches = touchesOf(scene);
        const auto same = withoutRinging(touches);
        for (std::size_t i = 0; i < touches.size(); ++i) {
          EXPECT_EQ(same[i].probe.values, touches[i].probe.values) << acceleration << " " << rate;
          EXPECT_EQ(same[i].machine.values, touches[i].machine.values);
        }
      }
    }
  }
}

TEST(Ringing, LeavesATouchAloneThatHardlyRests) {
  const auto touches = touchesOf(Scene{.dwell_s = 0.004});
  const auto same = withoutRinging(touches);
  for (std::size_t i = 0; i < touches.size(); ++i) EXPECT_EQ(same[i].probe.values, touches[i].probe.values);
}

// Shallow touches retract while the stylus rings by several deviations of a sample.
TEST(Ringing, DoesNotPullTheDelay) {
  std::mt19937_64 random{18};
  for (const auto& [scene, size_too] : {std::pair{simulation::knownSphere(), false}, std::pair{Scene{}, true}}) {
    if (size_too && !runsAreComplete()) continue;
    Judgement tau;
    for (int trial = 0; trial < 200; ++trial) {
      Scene shallow = scene;
      if (!size_too) shallow.overtravel_mm = 0.3;
      shallow.bounce_mm = size_too ? 0.1 : 0.02;
      shallow = simulation::shuffled(shallow, random);
      const auto solved = solve(simulation::measure(shallow, random));
      if (!solved.ok()) continue;
      const auto& found = *solved->find("tau_s");
      tau.add(found.value() - shallow.tau(), found.sd[0], simulation::referencePrecision(shallow).tau_sd_s);
    }
    EXPECT_GT(tau.pulls.count, 190);
    EXPECT_GT(tau.efficiency(), 1.0);
    // Under ringing the stated sd is up to a fifth too large.
    EXPECT_THAT(tau.pulls.pull(), testing::AllOf(testing::Gt(0.6), testing::Lt(1.3)));
    EXPECT_LT(std::abs(tau.pulls.bias()), 4.0);
  }
}

}  // namespace
}  // namespace probebox::metrology
