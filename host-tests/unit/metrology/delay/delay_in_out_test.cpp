// The delay from one drive in and out, against the bound (A17b).
#include "firmware/metrology/delay/delay_in_out.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using simulation::inOut;
using simulation::measure;
using simulation::Scene;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

Dataset record(const Scene& scene, std::mt19937_64& random) {
  Dataset dataset = measure(scene, random);
  dataset.config.clear();
  return dataset;
}

// (A17b): both streams at their own noise and rate, the square of the speed over the contact.
double boundOf(const Scene& scene) {
  const double speed = scene.speeds_mm_s.front();
  const double ramp = 0.5 * speed * speed / scene.acceleration_mm_s2;
  const double information =
      2.0 * speed * (scene.overtravel_mm - ramp) + 2.0 / 3.0 * speed * speed * speed / scene.acceleration_mm_s2;
  const double jitter = std::pow(scene.stamp_jitter_s * speed, 2);
  return std::sqrt(((std::pow(scene.machine_sigma_mm, 2) + jitter) / scene.machine_rate_hz +
                    (std::pow(scene.probe_sigma_mm, 2) + jitter) / scene.probe_rate_hz) /
                   information);
}

std::string refusalOfDrive(const Dataset& dataset) {
  const auto solved = solveDelayInOut(dataset);
  return solved.ok() ? "solved" : solved.error().name;
}

TEST(DelayInOut, IsUnbiasedEfficientAndAsUncertainAsItSays) {
  std::mt19937_64 random{41};
  for (const auto& [machine_hz, probe_hz, noise] : {std::tuple{500.0, 1000.0, 1.0}, {1000.0, 787.0, 3.0}}) {
    Moments tau;
    Scene scene = inOut();
    scene.machine_rate_hz = machine_hz;
    scene.probe_rate_hz = probe_hz;
    scene.machine_sigma_mm *= noise;
    scene.probe_sigma_mm *= noise;
    for (int trial = 0; trial < 200; ++trial) {
      scene = simulation::shuffled(scene, random);
      const auto solved = solveDelayInOut(record(scene, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
    }
    EXPECT_THAT(std::pow(boundOf(scene), 2) / tau.variance(), AllOf(Gt(0.65), Lt(1.3)));
    EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
    expectHonest(tau);
  }
}

struct Harder {
  std::string name;
  std::function<void(Scene&)> change;
  double least_efficiency{0.6};
};

void PrintTo(const Harder& harder, std::ostream* out) {
  *out << harder.name;
}

class HarderInOut : public testing::TestWithParam<Harder> {};

TEST_P(HarderInOut, IsUnbiasedEfficientAndAsUncertainAsItSays) {
  std::mt19937_64 random{53};
  Moments tau;
  Scene scene = inOut();
  GetParam().change(scene);
  for (int trial = 0; trial < 200; ++trial) {
    scene = simulation::shuffled(scene, random);
    const auto solved = solveDelayInOut(record(scene, random));
    if (!solved.ok()) {
      ASSERT_EQ(solved.error().name, "too-few-samples") << solved.error().reason;
      continue;
    }
    tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
  }
  EXPECT_GT(tau.count, 195);
  EXPECT_GT(std::pow(boundOf(scene), 2) / tau.variance(), GetParam().least_efficiency);
  EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  // Of 4000 drives with jittering stamps the mean square is 1.37, hardly ringing 1.19, of the others 0.85 to 1.0.
  EXPECT_THAT(tau.pull(), AllOf(Gt(0.6), Lt(1.4)));
}

// The stylus rings for a third of the contact; from 0.025 mm on it leaves the surface again, several times.
INSTANTIATE_TEST_SUITE_P(
    Drives, HarderInOut,
    testing::Values(Harder{"HardlyRinging", [](Scene& s) { s.bounce_mm = 0.002; }, 0.3},
                    Harder{"Ringing", [](Scene& s) { s.bounce_mm = 0.02; }, 0.3},
                    Harder{"Bouncing", [](Scene& s) { s.bounce_mm = 0.1; }},
                    Harder{"BouncingMuch", [](Scene& s) { s.bounce_mm = 0.2; }, 0.3},
                    Harder{"FastAndBouncing", [](Scene& s) { s.speeds_mm_s = {40.0}, s.bounce_mm = 0.05; }},
                    Harder{"Fast", [](Scene& s) { s.speeds_mm_s = {40.0}; }},
                    Harder{"HeavyMachine", [](Scene& s) { s.acceleration_mm_s2 = 2000.0; }},
                    Harder{"JitteringStamps", [](Scene& s) { s.stamp_jitter_s = 1e-4; }},
                    Harder{"MachineMuchSlower", [](Scene& s) { s.machine_rate_hz = 500.0, s.probe_rate_hz = 5000.0; }}),
    [](const auto& harder) { return harder.param.name; });

// One drive in a hundred has too few samples left for the ringing and the delay.
TEST(DelayInOut, AfterMuchBouncingIsAsUncertainAsItSaysOrRefused) {
  std::mt19937_64 random{53};
  Moments tau;
  Scene scene = inOut();
  scene.bounce_mm = 0.2;
  for (int trial = 0; trial < 600; ++trial) {
    scene = simulation::shuffled(scene, random);
    const auto solved = solveDelayInOut(record(scene, random));
    if (!solved.ok()) continue;
    const double off_s = solved->find("tau_s")->value() - scene.tau();
    const double sd_s = *solved->find("tau_s")->standardDeviation();
    EXPECT_LT(std::abs(off_s), 7 * sd_s) << "drive " << trial;
    tau.add(off_s, sd_s);
  }
  EXPECT_GT(tau.count, 585);
  expectHonest(tau);
}

TEST(DelayInOut, SaysThatTheStylusRang) {
  std::mt19937_64 random{50};
  Scene scene = inOut();
  scene.bounce_mm = 0.03;
  const auto solved = solveDelayInOut(record(scene, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("rang")));
  const auto quiet = solveDelayInOut(record(inOut(), random));
  ASSERT_TRUE(quiet.ok()) << quiet.error().reason;
  EXPECT_THAT(quiet->warnings, testing::Not(testing::Contains(testing::HasSubstr("rang at contact"))));
}

// A probe that is not linear in one of them matches nothing.
TEST(DelayInOut, LeavesOutADriveThatDoesNotMatchAsLongAsTheSpeedsOfTheOthersDiffer) {
  std::mt19937_64 random{52};
  Scene scene = inOut();
  for (const double speed_mm_s : {5.0, 6.0, 25.0}) scene.visits.push_back({{1, 0, 0}, speed_mm_s});
  Dataset dataset = record(scene, random);
  const auto bend = [&](double touch) {
    auto& probe = dataset.tables[1];
    for (std::size_t k = 0; k < probe.rows(); ++k)
      if (probe.columns[0].values[k] == touch)
        probe.columns[2].values[k] *= 1 + 0.5 * std::abs(probe.columns[2].values[k]);
  };
  const auto touches = dataset.tables[1].columns[0].values;
  bend(touches.front());
  const auto solved = solveDelayInOut(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1U);
  EXPECT_EQ(solved->dropped.front().reason, "residual-too-large");
  EXPECT_THAT(solved->warnings, testing::Contains(testing::StartsWith("dropped: " + solved->dropped.front().name)));
  const auto& tau = *solved->find("tau_s");
  EXPECT_NEAR(tau.value(), scene.tau(), 5 * *tau.standardDeviation());
  bend(touches.front() + 1);
  EXPECT_EQ(refusalOfDrive(dataset), "residual-too-large");
}

// A stylus that swings on after it has parted is not in contact.
TEST(DelayInOut, IgnoresWhatSwingsAfterSeparation) {
  std::mt19937_64 random{51};
  const Scene scene = inOut();
  Dataset dataset = record(scene, random);
  const double quiet = solveDelayInOut(dataset)->find("tau_s")->value();
  const auto& times = dataset.tables[1].columns[1].values;
  auto& values = dataset.tables[1].columns[2].values;
  const auto deflected = std::ranges::find_if(values.rbegin(), values.rend(), [](double d) { return d > 0.02; });
  const auto parted = static_cast<std::size_t>(values.rend() - deflected);
  for (std::size_t k = parted + 1; k < values.size(); ++k) {
    const double since = times[k] - times[parted];
    values[k] -= 0.05 * std::exp(-since / 0.009) * std::sin(2.0 * M_PI * 160.0 * since);
  }
  const auto solved = solveDelayInOut(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("tau_s")->value(), quiet, 0.3 * *solved->find("tau_s")->standardDeviation());
}

// Fewer than three samples between 60 and 10 % of the depth: shallow, or sampled slowly.
TEST(DelayInOut, NeedsFewSamplesOnTheWayInAndOut) {
  std::mt19937_64 random{48};
  const auto changes = {std::function<void(Scene&)>{[](Scene& s) { s.overtravel_mm = 0.2; }},
                        {[](Scene& s) { s.machine_rate_hz = 200.0, s.probe_rate_hz = 500.0; }}};
  for (const auto& change : changes) {
    Moments tau;
    Scene scene = inOut();
    change(scene);
    for (int trial = 0; trial < 200; ++trial) {
      scene = simulation::shuffled(scene, random);
      const auto solved = solveDelayInOut(record(scene, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
    }
    EXPECT_GT(std::pow(boundOf(scene), 2) / tau.variance(), 0.65);
    EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
    expectHonest(tau);
  }
}

TEST(DelayInOut, IsExactWithoutNoise) {
  std::mt19937_64 random{42};
  for (int trial = 0; trial < 20; ++trial) {
    const Scene scene = simulation::shuffled(simulation::withoutNoise(inOut()), random);
    const auto solved = solveDelayInOut(record(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 1e-12);
  }
}

// By another way: both streams resampled finely, and the shift tried out that leaves the least scatter of q + g d.
TEST(DelayInOut, AgreesWithASearchForTheLeastScatter) {
  std::mt19937_64 random{43};
  const Scene scene = simulation::shuffled(simulation::withoutNoise(inOut()), random);
  const Dataset dataset = record(scene, random);
  const auto& mt = *dataset.table("machine")->column("t_s");
  const auto& mx = *dataset.table("machine")->column("x_mm");
  const auto& pt = *dataset.table("probe")->column("t_s");
  const auto& pa = *dataset.table("probe")->column("a");
  const auto scatter = [&](double tau) {
    double n = 0, sq = 0, sd = 0, sqq = 0, sdd = 0, sqd = 0;
    for (std::size_t k = 0; k < mt.size(); ++k) {
      const auto next = std::ranges::upper_bound(pt, mt[k] - tau);
      if (next == pt.begin() || next == pt.end()) continue;
      const auto j = static_cast<std::size_t>(next - pt.begin());
      const double w = (mt[k] - tau - pt[j - 1]) / (pt[j] - pt[j - 1]);
      const double d = pa[j - 1] + w * (pa[j] - pa[j - 1]);
      if (std::abs(pa[j]) < 0.05 || std::abs(pa[j - 1]) < 0.05 || std::abs(d) > 0.45) continue;
      n += 1, sq += mx[k], sd += d, sqq += mx[k] * mx[k], sdd += d * d, sqd += mx[k] * d;
    }
    const double covariance = sqd / n - sq * sd / n / n;
    return sqq / n - sq * sq / n / n - covariance * covariance / (sdd / n - sd * sd / n / n);
  };
  double best = 0.0;
  for (double tau = 0.0; tau < 0.012; tau += 2e-6) {
    if (scatter(tau) < scatter(best)) best = tau;
  }
  EXPECT_NEAR(solveDelayInOut(dataset)->find("tau_s")->value(), best, 4e-6);
}

// The rate stands across deflection and constant, and a triangle shares cos = (1/2) / (1/sqrt3) with a constant.
TEST(DelayInOut, TellsTheConditionOfItsUnknowns) {
  std::mt19937_64 random{47};
  const auto solved = solveDelayInOut(record(inOut(), random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const double cosine = std::sqrt(3.0) / 2.0;
  EXPECT_NEAR(solved->condition, std::sqrt((1.0 + cosine) / (1.0 - cosine)), 0.3);
}

TEST(DelayInOut, AddsThePreviousDelay) {
  std::mt19937_64 random{44};
  Dataset dataset = record(inOut(), random);
  const double residual = solveDelayInOut(dataset)->find("tau_s")->value();
  dataset.config["previous_tau_s"] = 0.002;
  EXPECT_NEAR(solveDelayInOut(dataset)->find("tau_s")->value(), residual + 0.002, 1e-15);
  EXPECT_NEAR(solveDelayInOut(dataset)->find("residual_tau_s")->value(), residual, 1e-15);
}

// A probe that reads the distance from the surface: there is no contact, the whole drive is compared.
TEST(DelayInOut, MayComeFromAProbeThatDoesNotTouch) {
  std::mt19937_64 random{46};
  Moments tau;
  for (int trial = 0; trial < 60; ++trial) {
    const Scene scene = simulation::shuffled(inOut(), random);
    Dataset dataset = record(scene, random);
    const double far = 4.0;
    // What the machine was at when the probe read: the same motion, the machine's delay taken out.
    Scene probed = scene;
    probed.machine_rate_hz = scene.probe_rate_hz;
    probed.machine_sigma_mm = scene.probe_sigma_mm;
    probed.machine_delay_s = scene.probe_delay_s;
    const Dataset seen = record(probed, random);
    const Table& at = *seen.table("machine");
    Table distances{"probe", {at.columns[0], at.columns[1], {"distance_mm", at.columns[2].values}}};
    for (double& value : distances.columns[2].values) value += far - scene.centre_mm.x() - scene.radius_mm;
    dataset.tables[1] = distances;
    dataset.config["probe_kind"] = std::string{"distance"};
    const auto solved = solveDelayInOut(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
  }
  EXPECT_LT(tau.variance(), std::pow(8e-6, 2));
  EXPECT_LT(std::abs(tau.bias()), 4.0);
  expectHonest(tau);
}

TEST(DelayInOut, IsRefusedWhenTheRecordDoesNotSuffice) {
  std::mt19937_64 random{45};
  Scene resting = inOut();
  resting.dwell_s = 0.03;
  EXPECT_EQ(refusalOfDrive(record(resting, random)), "flat-apex");
  Dataset loose = record(inOut(), random);
  for (std::size_t k = 0; k < loose.tables[1].rows(); k += 3) loose.tables[1].columns[2].values[k] *= 0.9;
  EXPECT_EQ(refusalOfDrive(loose), "residual-too-large");
  Scene untouched = inOut();
  untouched.overtravel_mm = 1e-9;
  EXPECT_EQ(refusalOfDrive(record(untouched, random)), "no-contact");

  Dataset clipped = record(inOut(), random);
  for (auto& value : clipped.tables[1].columns[2].values) value = std::clamp(value, -0.3, 0.3);
  EXPECT_EQ(refusalOfDrive(clipped), "clipped");
  Dataset missing = record(inOut(), random);
  for (auto& column : missing.tables[1].columns) column.values.erase(column.values.begin() + 40);
  EXPECT_EQ(refusalOfDrive(missing), "gap");
  Dataset not_a_number = record(inOut(), random);
  not_a_number.tables[1].columns[3].values[30] = std::nan("");
  EXPECT_EQ(refusalOfDrive(not_a_number), "not-finite");
}

}  // namespace
}  // namespace probebox::metrology
