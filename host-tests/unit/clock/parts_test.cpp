#include <cmath>
#include <gmock/gmock.h>
#include <random>

#include "firmware/clock/acquisition.hpp"
#include "firmware/clock/score.hpp"
#include "firmware/clock/wander.hpp"
#include "trial.hpp"

namespace probebox::clock {
namespace {

// What one residual tells about the location with this score, on residuals that it has not learned from.
template <class Draw>
double informationOf(const Score& score, Draw&& draw) {
  double squares = 0;
  double slopes = 0;
  constexpr int kResiduals = 200'000;
  for (int i = 0; i < kResiduals; ++i) {
    const Score::Value value = score(draw());
    squares += value.psi * value.psi / kResiduals;
    slopes += value.slope / kResiduals;
  }
  return slopes * slopes / squares;
}

template <class Draw>
Score learnedFrom(int residuals, Draw&& draw) {
  Score score;
  for (int i = 0; i < residuals; ++i) score.collect(draw());
  score.solve();
  return score;
}

TEST(LearnedScore, OfGaussianResidualsIsTheResidual) {
  std::mt19937_64 random{1};
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  const Score score = learnedFrom(50'000, draw);
  EXPECT_GT(informationOf(score, draw), 0.95);
  for (const double r : {-2.0, -1.0, 0.0, 0.5, 1.5}) EXPECT_NEAR(score(r).psi, r, 0.4) << r;
}

// In closed form: psi = tanh(r / 2), information 1/3, for logistic residuals; here in units of their robust spread.
TEST(LearnedScore, OfLogisticResidualsIsTheirTanh) {
  constexpr double kSpread = 1.4826 * 1.0986;
  std::mt19937_64 random{2};
  std::uniform_real_distribution<double> uniform{1e-12, 1 - 1e-12};
  const auto draw = [&] {
    const double u = uniform(random);
    return std::log(u / (1 - u)) / kSpread;
  };
  const Score score = learnedFrom(100'000, draw);
  EXPECT_GT(informationOf(score, draw), 0.95 * kSpread * kSpread / 3);
  for (const double r : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
    EXPECT_NEAR(score(r).psi, kSpread * std::tanh(kSpread * r / 2), 0.4) << r;
  }
}

// About location a skewed density tells far more than one over its variance.
TEST(LearnedScore, UsesMostOfWhatASkewedDensityTells) {
  constexpr double kShape = 0.5;
  const double information = std::exp(2 * kShape * kShape) * (1 + 1 / (kShape * kShape));
  std::mt19937_64 random{9};
  std::lognormal_distribution<double> lognormal{0, kShape};
  const auto draw = [&] { return 2 * (lognormal(random) - 1.1); };
  EXPECT_GT(informationOf(learnedFrom(50'000, draw), draw), 0.88 * information / 4);
}

TEST(LearnedScore, HasMeanZeroOverWhatItLearnedFrom) {
  std::mt19937_64 random{3};
  std::lognormal_distribution<double> skewed{0, 0.5};
  std::vector<double> residuals(50'000);
  Score score;
  for (double& r : residuals) score.collect(r = 2 * (skewed(random) - 1.1));
  score.solve();
  double mean = 0;
  for (const double r : residuals) mean += score(r).psi / static_cast<double>(residuals.size());
  EXPECT_NEAR(mean, 0, 2e-3);
}

TEST(LearnedScore, HardlyListensToOutliers) {
  std::mt19937_64 random{4};
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> far{-30, 30};
  Score score;
  for (int i = 0; i < 100'000; ++i) score.collect(i % 50 == 0 ? far(random) : normal(random));
  score.solve();
  for (const double r : {-100.0, -25.0, -15.0, 15.0, 25.0, 100.0}) EXPECT_LT(std::abs(score(r).psi), 1) << r;
}

TEST(LearnedWander, FindsTheWalkThatMadeThePhases) {
  for (const double ppb : {10.0, 100.0, 1000.0}) {
    support::SyncSignal signal;
    signal.frequency_wander_ppb_per_sqrt_s = ppb;
    clock_test::Trial trial{signal, 5};
    trial.steps(130'000);
    EXPECT_THAT(trial.estimator.wander().frequencyPpbPerSqrtS(),
                testing::AllOf(testing::Gt(ppb / 3), testing::Lt(ppb * 3)));
  }
}

TEST(Acquisition, FindsTheGridAmongStrays) {
  Acquisition acquisition{Nanoseconds{1'000'000}};
  std::mt19937_64 random{6};
  std::normal_distribution<double> jitter{0, 5000};
  std::uniform_int_distribution<std::int64_t> anywhere{-400'000, 400'000};
  std::optional<Acquisition::Grid> grid;
  for (std::int64_t tick = 0; tick < 200 && !grid; ++tick) {
    if (tick % 5 == 2) continue;
    const std::int64_t true_ns = 777'000 + tick * 1'000'000;
    grid = acquisition.push(monoTime(true_ns + std::llround(jitter(random))));
    if (grid) {
      EXPECT_NEAR(static_cast<double>(toNs(grid->at) - true_ns), 0, 15'000);
    }
    if (!grid && tick % 6 == 3) grid = acquisition.push(monoTime(true_ns + 450'000 + anywhere(random) / 10));
  }
  EXPECT_TRUE(grid);
}

}  // namespace
}  // namespace probebox::clock
