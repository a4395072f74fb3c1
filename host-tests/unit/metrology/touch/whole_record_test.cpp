// The delay from the whole record of each touch, against a bound of that record that knows nothing of the estimator.
#include "firmware/metrology/touch/whole_record.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <string>

#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using simulation::Scene;

// A trapezoid of speed: the place along the way, from 0 to its length, and the speed.
struct Drive {
  double length, speed, acceleration;
  bool stops;

  double ramp() const { return speed / acceleration; }
  double duration() const {
    return (length - 0.5 * speed * ramp() * (stops ? 2 : 1)) / speed + ramp() * (stops ? 2 : 1);
  }
  double place(double t) const {
    if (t <= 0) return 0;
    if (t < ramp()) return 0.5 * acceleration * t * t;
    const double left = duration() - t;
    if (stops && left < ramp()) return length - (left > 0 ? 0.5 * acceleration * left * left : 0);
    return speed * (t - 0.5 * ramp());
  }
};

// Bound of Cramer and Rao for the delay that one touch tells. Unknown with it: the path (a cubic spline with knots
// 4 ms apart), the place of the surface, the gain, and amplitudes, frequency and decay of the bounce.
double boundOfOneTouch(const Scene& scene, double speed) {
  constexpr double kLead = 0.003, kKnots = 0.004, kDecay = 1 / 0.009, kHertz = 160;
  const Drive in{scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, true};
  const Drive out{2 * scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, false};
  const double parts = kLead + in.duration() + scene.dwell_s, whole = parts + out.duration();
  const auto depth = [&](double t) { return in.place(t - kLead) - out.place(t - parts) - scene.clearance_mm; };
  double contact = 0;
  while (depth(contact) <= 0) contact += 1e-5;
  const auto pieces = static_cast<Index>(std::ceil(whole / kKnots));
  const Index bounce = pieces + 3 + 3, unknowns = scene.bounce_mm > 0 ? bounce + 4 : bounce;
  const auto spline = [&](double t, double factor, VectorXd& row) {
    const double at = std::clamp(t / kKnots, 0.0, static_cast<double>(pieces) - 1e-9), f = at - std::floor(at),
                 g = 1 - f;
    row.segment<4>(static_cast<Index>(at)) +=
        factor / 6 *
        Eigen::Vector4d{g * g * g, 3 * f * f * f - 6 * f * f + 4, 3 * g * g * g - 6 * g * g + 4, f * f * f};
  };
  MatrixXd information = MatrixXd::Zero(unknowns, unknowns);
  for (double t = 0; t < whole; t += 1 / scene.machine_rate_hz) {
    VectorXd row = VectorXd::Zero(unknowns);
    spline(t, -1, row);
    row[pieces + 3] = -(depth(t + 1e-6) - depth(t - 1e-6)) / 2e-6;
    information += row * row.transpose() / std::pow(scene.machine_sigma_mm, 2);
  }
  for (double t = contact; t < whole; t += 1 / scene.probe_rate_hz) {
    if (depth(t) <= 0) continue;
    const double age = t - contact, w = 2 * std::numbers::pi * kHertz, fade = std::exp(-kDecay * age);
    VectorXd row = VectorXd::Zero(unknowns);
    spline(t, 1, row);
    row[pieces + 4] = 1;
    row[pieces + 5] = depth(t) + scene.bounce_mm * fade * std::sin(w * age);
    if (unknowns > bounce) {
      row.tail<4>() << fade * std::sin(w * age), fade * std::cos(w * age),
          scene.bounce_mm * fade * 2 * std::numbers::pi * age * std::cos(w * age),
          -scene.bounce_mm * age * fade * std::sin(w * age);
    }
    information += row * row.transpose() / std::pow(scene.probe_sigma_mm, 2);
  }
  // A piece of the spline that no sample shows is held where it is.
  const VectorXd sizes = information.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = sizes.asDiagonal() * information * sizes.asDiagonal();
  const MatrixXd inverse = (scaled + 1e-11 * MatrixXd::Identity(unknowns, unknowns)).inverse();
  return sizes[pieces + 3] * std::sqrt(inverse(pieces + 3, pieces + 3));
}

// Of all touches of a scene; at several speeds with a lost motion along the drive unknown.
double boundOf(const Scene& scene) {
  const auto touches = static_cast<double>(scene.normals.size());
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  for (const double speed : scene.speeds_mm_s) {
    const Eigen::Vector2d row{1, 0.5 / speed};
    information += touches * row * row.transpose() / std::pow(boundOfOneTouch(scene, speed), 2);
  }
  if (!scene.more_delay_s.isZero()) return std::sqrt(3 / information(0, 0));
  return scene.speeds_mm_s.size() > 1 ? std::sqrt(information.inverse()(0, 0)) : std::sqrt(1 / information(0, 0));
}

Outcome<WholeRecord, Refusal> fitted(const Scene& scene, std::mt19937_64& random) {
  const auto touches = readTouches(measure(scene, random)).value();
  const bool each_axis = !scene.more_delay_s.isZero();
  WholeRecordQuestion question{.carried = MatrixXd::Ones(std::ssize(touches), each_axis ? 3 : 1)};
  for (Index i = 0; each_axis && i < question.carried.rows(); ++i)
    question.carried.row(i) = touches[static_cast<std::size_t>(i)].plan.retract.cwiseAbs2().transpose();
  return fitWholeRecord(touches, question);
}

struct Kind {
  std::string name;
  std::function<Scene()> scene;
  double least_efficiency{0.8};  // 0: the bound does not know what is wrong with the record
};
void PrintTo(const Kind& kind, std::ostream* out) {
  *out << kind.name;
}

class WholeRecordOf : public testing::TestWithParam<Kind> {};

TEST_P(WholeRecordOf, TellsTheDelayNearlyAsWellAsItCanBeTold) {
  std::mt19937_64 random{46};
  const auto trials = runs(200);
  Moments tau, size;
  double bound = 0;
  int warned = 0;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    const Scene scene = simulation::shuffled(GetParam().scene(), random);
    if (trial == 0) bound = boundOf(scene);
    const auto found = fitted(scene, random);
    ASSERT_TRUE(found) << found.error().reason;
    for (Index k = 0; k < found->tau_s.size(); ++k)
      tau.add(found->tau_s[k] - scene.tauOf(k), std::sqrt(found->covariance(k, k)));
    warned += testing::Matches(testing::Contains(testing::StartsWith("lost-motion: ")))(found->warnings) ? 1 : 0;
    const Index at = found->sizeAt();
    size.add(found->size_mm - 2 * std::abs(scene.radius_mm), std::sqrt(found->covariance(at, at)));
  }
  const double uncertain = std::sqrt(2 / static_cast<double>(tau.count));
  EXPECT_LE(warned, static_cast<int>(trials / 25)) << "of lost motion that is not there";
  EXPECT_GT(bound * bound / tau.variance(), GetParam().least_efficiency * (1 - uncertain));
  EXPECT_GT(tau.variance() / (bound * bound), 0.9 * rangeOf({.dof = tau.count}).low) << "nothing beats a bound";
  for (const auto& moments : {tau, size}) {
    const double chance = 3 * std::sqrt(0.5 / static_cast<double>(moments.count));
    // Of rounded and correlated samples the sd is cautious.
    EXPECT_GT(std::sqrt(moments.pull()), std::min(GetParam().least_efficiency > 0 ? 0.85 : 0.8, 1 - chance));
    EXPECT_LT(std::sqrt(moments.pull()), std::max(1.18, 1 + chance));
    EXPECT_LT(std::abs(moments.bias()), 4);
  }
}

Scene changed(Scene scene, const std::function<void(Scene&)>& change) {
  change(scene);
  return scene;
}
std::function<Scene()> sphere(const std::function<void(Scene&)>& change = [](Scene&) {}) {
  return [=] { return changed(simulation::knownSphere(), change); };
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, WholeRecordOf,
    testing::Values(Kind{"Sphere", sphere()}, Kind{"Plates", simulation::plates}, Kind{"EachAxis", simulation::perAxis},
                    Kind{"OffTheNormal", simulation::nonNormal}, Kind{"SeveralSpeeds", [] { return Scene{}; }},
                    Kind{"TwoSpeeds", sphere([](Scene& s) {
                           s.speeds_mm_s = {10, 25};
                         })},
                    Kind{"NoBounce", sphere([](Scene& s) { s.bounce_mm = 0; })},
                    Kind{"LargeBounce", sphere([](Scene& s) { s.bounce_mm = 0.1; })},
                    Kind{"BounceOffTheSurface", sphere([](Scene& s) {
                           s.bounces_off = true;
                           s.speeds_mm_s = {10, 40};
                         }),
                         0},
                    Kind{"LostSamples", sphere([](Scene& s) { s.lost_share = 0.01; })},
                    Kind{"Jitter", sphere([](Scene& s) { s.stamp_jitter_s = 1e-4; }), 0},
                    Kind{"CoarseEncoder", sphere([](Scene& s) { s.machine_resolution_mm = 0.005; }), 0},
                    Kind{"FromWithin", sphere([](Scene& s) { s.radius_mm = -12; })},
                    Kind{"Correlated", sphere([](Scene& s) { s.correlation = 0.5; }), 0}),
    [](const auto& kind) { return kind.param.name; });

TEST(WholeRecord, IsExactWithoutNoise) {
  std::mt19937_64 random{5};
  for (const Scene& start : {simulation::knownSphere(), simulation::perAxis(), simulation::nonNormal(), Scene{}}) {
    Scene scene = simulation::shuffled(simulation::withoutNoise(start), random);
    scene.bounce_mm = 0;
    const auto found = fitted(scene, random);
    ASSERT_TRUE(found) << found.error().reason;
    for (Index k = 0; k < found->tau_s.size(); ++k) EXPECT_NEAR(found->tau_s[k], scene.tauOf(k), 1e-9);
    EXPECT_NEAR(found->size_mm, 31, 1e-7);
    for (const double lost : found->lost_mm) EXPECT_NEAR(lost, 0, 1e-7);
  }
}

// Encoders go ahead of what they move by half of the lost motion, whichever way it goes.
std::vector<Touch> withLostMotion(std::vector<Touch> touches, const Eigen::Vector3d& lost_mm) {
  for (auto& touch : touches) {
    const auto place = touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()});
    // At rest the way in is still in it.
    const double rest = std::ranges::min(place) + 0.003;
    const auto last =
        place.rend() - std::ranges::find_if(place.rbegin(), place.rend(), [&](double one) { return one < rest; });
    for (Index k = 0; k < touch.machine.values.rows(); ++k) {
      const double way = k < last ? -0.5 : 0.5;
      touch.machine.values.row(k) += way * touch.plan.retract.cwiseProduct(lost_mm).transpose();
    }
  }
  return touches;
}

TEST(WholeRecord, PartsLostMotionFromTheDelayByTwoSpeeds) {
  std::mt19937_64 random{47};
  Scene scene = simulation::knownSphere();
  scene.speeds_mm_s = {10, 25};
  const Eigen::Vector3d lost_mm{0.005, 0.002, 0.008};
  const auto touches = withLostMotion(readTouches(measure(scene, random)).value(), lost_mm);
  const auto found = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1)});
  ASSERT_TRUE(found) << found.error().reason;
  ASSERT_EQ(found->lost_mm.size(), 3);
  for (Index k = 0; k < 3; ++k) {
    const double sd = std::sqrt(found->covariance(found->lostAt() + k, found->lostAt() + k));
    EXPECT_NEAR(found->lost_mm[k], lost_mm[k], 5 * sd);
    EXPECT_LT(sd, 0.001);
  }
  EXPECT_NEAR(found->tau_s[0], scene.tau(), 5 * std::sqrt(found->covariance(0, 0)));
  EXPECT_NEAR(found->size_mm, 31, 0.001);
}

// At one speed the delay holds it as l / 2 S, and the size stays what it is.
TEST(WholeRecord, HoldsLostMotionInTheDelayAtOneSpeed) {
  std::mt19937_64 random{48};
  const Scene scene = simulation::knownSphere();
  const auto touches = withLostMotion(readTouches(measure(scene, random)).value(), {0.005, 0.005, 0.005});
  const auto found = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1)});
  ASSERT_TRUE(found) << found.error().reason;
  EXPECT_EQ(found->lost_mm.size(), 0);
  EXPECT_NEAR(found->tau_s[0], scene.tau() - 0.005 / 50, 12e-6);
  EXPECT_NEAR(found->size_mm, 31, 0.0015);
  // Where the machine stands at rest gives it away.
  EXPECT_THAT(found->warnings, testing::Contains(testing::StartsWith("lost-motion: ")));
  const auto known = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1), .lost_mm = 0.005});
  ASSERT_TRUE(known) << known.error().reason;
  EXPECT_NEAR(known->tau_s[0], scene.tau(), 12e-6);
  EXPECT_TRUE(known->warnings.empty()) << known->warnings.front();
}

TEST(WholeRecord, SeesAGainThatBends) {
  std::mt19937_64 random{49};
  const Scene scene = simulation::knownSphere();
  auto touches = readTouches(measure(scene, random)).value();
  for (auto& touch : touches) {
    for (auto row : touch.probe.values.rowwise()) row *= 1 + 0.02 * row.norm() / 0.5;
  }
  const auto found = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1)});
  ASSERT_TRUE(found) << found.error().reason;
  EXPECT_NEAR(found->bend_per_mm, 0.04, 0.01);
  EXPECT_NEAR(found->tau_s[0], scene.tau(), 15e-6);
  EXPECT_NEAR(found->size_mm, 31, 0.0015);
}

TEST(WholeRecord, IsRefusedWithoutAnyWayIn) {
  std::mt19937_64 random{50};
  auto touches = readTouches(measure(simulation::knownSphere(), random)).value();
  for (auto& touch : touches) {
    for (Stream Touch::*stream : {&Touch::machine, &Touch::probe}) {
      auto& [times, values, steps] = touch.*stream;
      const auto first = std::ranges::lower_bound(times, times.front() + 0.055) - times.begin();
      values = Rows3{values.bottomRows(values.rows() - first)};
      times.erase(times.begin(), times.begin() + first);
    }
  }
  const auto found = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1)});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().name, "way-in-missing") << found.error().reason;
}

TEST(WholeRecord, LosesASampleWhereOneIsWild) {
  std::mt19937_64 random{51};
  const Scene scene = simulation::knownSphere();
  auto touches = readTouches(measure(scene, random)).value();
  for (std::size_t i = 0; i < touches.size(); ++i) {
    touches[i].probe.values.row(30 + 7 * static_cast<Index>(i)).array() += 0.2;
    touches[i].machine.values.row(12 + 5 * static_cast<Index>(i)).array() -= 1.0;
  }
  const auto found = fitWholeRecord(touches, {.carried = MatrixXd::Ones(std::ssize(touches), 1)});
  ASSERT_TRUE(found) << found.error().reason;
  EXPECT_EQ(found->touches.size(), 5);
  EXPECT_NEAR(found->tau_s[0], scene.tau(), 15e-6);
}

}  // namespace
}  // namespace probebox::metrology
