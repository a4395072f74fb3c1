#include "protocol/codec/tight_predictor.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::codec {
namespace {

// Degree of the polynomial, and how much of a sample's weight remains one sample later. The first one follows the
// fastest motion and lets through most noise.
struct Fading {
  int degree{};
  double memory{};
};
constexpr std::array<Fading, 7> kFading{{{3, 0.3}, {0, 0.95}, {2, 0.7}, {1, 0.8}, {2, 0.85}, {3, 0.7}, {3, 0.85}}};

constexpr double kMixerMemory = 0.998;
constexpr std::uint32_t kMixesFrom = 8;   // samples
constexpr std::uint32_t kJumpsFrom = 16;  // samples
constexpr double kJump = 10;              // standard deviations
constexpr double kFarthest = 4e18;        // from one value to the next

}  // namespace

// Those of discounted least squares (N. Morrison, Introduction to Sequential Smoothing and Prediction, 1969, ch. 13).
// The first samples have no past to fade: as many as there are count alike.
TightPredictor::Coefficients TightPredictor::gains(std::size_t filter, double samples) {
  const auto [degree, memory] = kFading[filter];
  const double m = std::max(0.0, std::min(memory, 1 - (degree + 1) / samples));
  const double o = 1 - m;
  switch (degree) {
    case 0:
      return {o, 0, 0, 0};
    case 1:
      return {1 - m * m, o * o, 0, 0};
    case 2:
      return {1 - m * m * m, 1.5 * o * o * (1 + m), 0.5 * o * o * o, 0};
    default:
      return {1 - m * m * m * m, o * o * (11 + 14 * m + 11 * m * m) / 6, o * o * o * (1 + m), o * o * o * o / 6};
  }
}

TightPredictor::Expected TightPredictor::expected() {
  const double first = filters_[0][0];
  for (std::size_t k = 1; k < kFilters; ++k) inputs_[k - 1] = filters_[k][0] - first;
  mixed_ = 0;
  if (samples_ >= kMixesFrom) {
    for (std::size_t k = 0; k < kInputs; ++k) mixed_ += weights_[k] * inputs_[k];
  }
  expected_ = first + mixed_;
  if (!(std::abs(expected_) < kFarthest)) forget();
  const double down = std::floor(expected_);
  const auto whole = static_cast<std::uint64_t>(last_) + static_cast<std::uint64_t>(static_cast<std::int64_t>(down));
  return {static_cast<std::int64_t>(whole), expected_ - down, std::max(std::sqrt(variance_), kLeastSd), samples_ >= 4};
}

// What has grown beyond all numbers is of no use any more.
void TightPredictor::forget() {
  const auto last = last_;
  *this = {};
  last_ = last;
  samples_ = 1;
}

void TightPredictor::learn(std::int64_t value) {
  const auto step = static_cast<double>(
      static_cast<std::int64_t>(static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(last_)));
  last_ = value;
  if (samples_ > 0) {
    const double residual = step - expected_;
    const bool is_jump = samples_ >= kJumpsFrom && std::abs(residual) > kJump * std::max(std::sqrt(variance_), 0.5);
    if (samples_ >= kMixesFrom && !is_jump) mix(residual);
    scale(residual, is_jump);
    follow(step, is_jump);
  }
  ++samples_;
  if (samples_ == kMixesFrom) beginMixing();
}

// With the weights that there are.
void TightPredictor::beginMixing() {
  covariance_ = {};
  for (std::size_t k = 0; k < kInputs; ++k) covariance_[k][k] = 1;
}

void TightPredictor::mix(double error) {
  Inputs gain{};
  for (std::size_t row = 0; row < kInputs; ++row) {
    for (std::size_t k = 0; k < kInputs; ++k) gain[k] += covariance_[row][k] * inputs_[row];
  }
  double spread = kMixerMemory;
  for (std::size_t k = 0; k < kInputs; ++k) spread += gain[k] * inputs_[k];
  if (!(spread >= kMixerMemory && spread < 1e30)) {  // no covariance any more, by rounding
    return beginMixing();
  }
  const double inverse = 1 / spread;
  for (std::size_t k = 0; k < kInputs; ++k) weights_[k] += gain[k] * inverse * error;
  for (std::size_t row = 0; row < kInputs; ++row) {
    const double of_row = gain[row] * inverse;
    for (std::size_t k = 0; k < kInputs; ++k)
      covariance_[row][k] = (covariance_[row][k] - of_row * gain[k]) * (1 / kMixerMemory);
  }
}

// One outlier says little, several in succession that the noise has become another.
void TightPredictor::scale(double residual, bool is_jump) {
  if (samples_ < 3) return;
  jumps_ = is_jump ? std::min(jumps_ + 1, 30U) : 0;
  const double most = 16 * (variance_ + 0.01) * static_cast<double>(std::uint64_t{1} << (2 * jumps_));
  const double rate = samples_ < 16 ? 0.25 : samples_ < 64 ? 0.08 : 0.04;
  const double square = samples_ < kJumpsFrom ? residual * residual : std::min(residual * residual, most);
  variance_ += (samples_ == 3 ? 1 : rate) * (square - variance_);
}

// At a jump the place is another one and the motion goes on.
void TightPredictor::follow(double step, bool is_jump) {
  std::copy_backward(inputs_.begin() + kFilters - 1, inputs_.end() - 1, inputs_.end());
  inputs_[kFilters - 1] = is_jump ? 0 : step - filters_[0][0];
  for (std::size_t k = 0; k < kFilters; ++k) {
    if (samples_ <= 64) gains_[k] = gains(k, samples_ + 1.0);
    auto& [place, speed, acceleration, jerk] = filters_[k];
    const double residual = is_jump ? 0 : step - place;
    place = is_jump ? 0 : place + gains_[k][0] * residual - step;
    speed += gains_[k][1] * residual;
    acceleration += gains_[k][2] * residual;
    jerk += gains_[k][3] * residual;
    place += speed + acceleration + jerk;
    speed += 2 * acceleration + 3 * jerk;
    acceleration += 3 * jerk;
  }
}

}  // namespace probebox::codec
