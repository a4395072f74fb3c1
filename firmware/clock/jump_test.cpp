#include "firmware/clock/jump_test.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace probebox::clock {
namespace {

// When the hypotheses are compared, and the logarithm of the likelihood ratio that a jump needs then. Few residuals
// need more, because two outliers may lie close together; the last look needs more, because nothing takes it back.
struct Look {
  std::size_t residuals{};
  double evidence{};
};
constexpr std::array<Look, 7> kLooks{{{8, 10}, {12, 9}, {16, 7}, {20, 6}, {32, 6}, {48, 8}, {JumpTest::kEdges, 10}}};
constexpr int kSteps = 6;  // of the search for the shift; each leaves less than a third of its error

}  // namespace

void JumpTest::begin(const PhaseFilter& held) {
  held_ = held;
  count_ = 0;
  running_ = true;
  jumped_ = false;
}

bool JumpTest::push(const PhaseFilter& predicted, double residual_ns, const Jitter& jitter) {
  held_.predict(predicted.tick() - held_.tick());
  residuals_ns_[count_++] = residual_ns + predicted.aheadOf(held_);
  const bool was_jumped = jumped_;
  const auto* const look = std::ranges::find(kLooks, count_, &Look::residuals);
  if (look != kLooks.end()) jumped_ = evidence(jitter) > look->evidence;
  if (count_ == kEdges) running_ = false;
  return jumped_ != was_jumped;
}

// Finds the most likely shift by Fisher scoring from the median. Where the held phase is uncertain itself, a shift
// within its sigma is no evidence: for Gaussian jitter the logarithm of the ratio falls by jitter / (jitter + n phase
// variance).
double JumpTest::evidence(const Jitter& jitter) {
  const std::span all{residuals_ns_.data(), count_};
  std::array<double, kEdges> sorted = residuals_ns_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(count_ / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(count_));
  const auto n = static_cast<double>(count_);
  shift_ns_ = *middle;
  for (int step = 0; step < kSteps; ++step) {
    double sum = 0;
    for (const double residual : all) sum += jitter.innovation(residual - shift_ns_);
    shift_ns_ += sum / n;
  }
  double ratio = 0;
  for (const double residual : all)
    ratio += jitter.logLikelihood(residual - shift_ns_) - jitter.logLikelihood(residual);
  const double variance = jitter.varianceNs2();
  shift_sigma_ns_ = std::sqrt(variance / n);
  return ratio * variance / (variance + n * held_.phaseVariance());
}

}  // namespace probebox::clock
