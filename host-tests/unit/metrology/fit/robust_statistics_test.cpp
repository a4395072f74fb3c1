// Samples of one stream at the stamps of another (docs/metrology.md A.9).
#include "firmware/metrology/fit/robust_statistics.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace probebox::metrology {
namespace {

constexpr double kAngular = 60.0;  // rad/s
constexpr double kPeriod = 0.002;

Signal wave(double jitter) {
  std::mt19937_64 random{81};
  std::uniform_real_distribution<double> apart{1.0 - jitter, 1.0 + jitter};
  Signal signal;
  for (double t = 0.0; t < 0.5; t += kPeriod * apart(random)) {
    signal.times.push_back(t);
    signal.values.push_back(std::sin(kAngular * t));
  }
  return signal;
}

double worstError(const Signal& signal, Interpolation interpolation) {
  const Interpolant between{signal, interpolation};
  double worst = 0.0;
  std::size_t cursor = 0;
  for (double t = 3.0 * kPeriod; t < 0.48; t += kPeriod / 7.0) {
    worst = std::max(worst, std::abs(between.at(t, cursor).value - std::sin(kAngular * t)));
  }
  return worst;
}

TEST(Interpolant, ErrsByNoMoreThanItsBoundAndNotMuchLess) {
  const double linear = std::pow(kPeriod * kAngular, 2) / 8.0;
  const double cubic = 3.0 / 128.0 * std::pow(kPeriod * kAngular, 4);
  EXPECT_LT(worstError(wave(0.0), Interpolation::linear), linear);
  EXPECT_GT(worstError(wave(0.0), Interpolation::linear), 0.9 * linear);
  EXPECT_LT(worstError(wave(0.0), Interpolation::cubic), cubic);
  EXPECT_GT(worstError(wave(0.0), Interpolation::cubic), 0.9 * cubic);
}

TEST(Interpolant, GoesThroughCubicsExactlyWhateverTheStamps) {
  Signal signal = wave(0.4);
  const auto cubic = [](double t) { return 1.0 + t * (2.0 - t * (30.0 - 40.0 * t)); };
  for (std::size_t k = 0; k < signal.times.size(); ++k) signal.values[k] = cubic(signal.times[k]);
  const Interpolant between{signal, Interpolation::cubic};
  std::size_t cursor = 0;
  for (double t = 0.01; t < 0.48; t += 0.00037) {
    const auto sample = between.at(t, cursor);
    EXPECT_NEAR(sample.value, cubic(t), 1e-12);
    EXPECT_NEAR(sample.rate, 2.0 - t * (60.0 - 120.0 * t), 1e-9);
    // The weights of the samples say the same.
    Eigen::VectorXd gains = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(signal.values.size()));
    std::size_t same = cursor;
    between.addGains(t, 1.0, same, gains);
    EXPECT_NEAR(gains.dot(Eigen::VectorXd::Map(signal.values.data(), gains.size())), sample.value, 1e-12);
    EXPECT_NEAR(between.varianceAt(t, same), gains.squaredNorm(), 1e-12);
  }
}

TEST(SampleVariance, IsThatOfTheNoiseWhateverTheMotion) {
  std::mt19937_64 random{82};
  std::normal_distribution<double> noise{0.0, 0.003};
  Signal signal;
  for (int k = 0; k < 20000; ++k) {
    signal.times.push_back(kPeriod * k);
    signal.values.push_back(std::sin(20.0 * kPeriod * k) + noise(random));
  }
  EXPECT_NEAR(sampleVariance(signal, Interpolation::cubic), 9e-6, 6e-7);
  // A line misses the bends, but stands kinks and spikes better.
  for (double& value : signal.values) value = noise(random);
  for (std::size_t k = 50; k < signal.values.size(); k += 100) signal.values[k] += 1.0;
  EXPECT_NEAR(sampleVariance(signal, Interpolation::linear), 9e-6, 8e-7);
}

}  // namespace
}  // namespace probebox::metrology
