#include "firmware/clock/frequency_test.hpp"

#include <cmath>
#include <numbers>

namespace probebox::clock {
namespace {

constexpr double kChanged = 6;       // log likelihood ratio; a held line reaches it in at most one of 400 tests (Ville)
constexpr double kSameVariance = 2;  // ratio of the variances of the frequency

double logGaussian(double value, double variance) {
  return -0.5 * (std::log(variance) + value * value / variance);
}

}  // namespace

void FrequencyTest::begin(const PhaseFilter& held, std::int64_t gap_ticks, double change_sigma_ns, double shift_ns,
                          double shift_sigma_ns) {
  held_ = changed_ = held;
  // Whether the frequency changed at the begin of the gap or at its end is not known. The stamps since then are few
  // beside the gap: their time is neglected.
  changed_.loosen(change_sigma_ns / std::numbers::sqrt2, gap_ticks);
  changed_.loosen(change_sigma_ns / std::numbers::sqrt2, 0);
  evidence_ = 0;
  weigh(shift_ns, shift_sigma_ns * shift_sigma_ns);
  in_block_ = 0;
  running_ = true;
}

bool FrequencyTest::push(const PhaseFilter& predicted, double innovation_ns, double variance_ns2) {
  if (in_block_ == 0) {
    held_ = predicted;
    ticks_ = 0;
    innovations_ns_ = 0;
  }
  ++in_block_;
  ticks_ += predicted.tick() - held_.tick();
  innovations_ns_ += innovation_ns + predicted.aheadOf(held_);
  if (in_block_ < kBlock) return false;
  held_.predict(ticks_ / kBlock);
  changed_.predict(held_.tick() - changed_.tick());
  weigh(innovations_ns_ / kBlock, variance_ns2 / kBlock);
  in_block_ = 0;
  const bool has_changed = evidence_ > kChanged;
  running_ = !has_changed && changed_.driftVariance() > kSameVariance * held_.driftVariance();
  return has_changed;
}

// innovation_ns: to the held line, both lines at its tick.
void FrequencyTest::weigh(double innovation_ns, double variance_ns2) {
  const double to_changed_ns = innovation_ns + held_.aheadOf(changed_);
  evidence_ += logGaussian(to_changed_ns, changed_.phaseVariance() + variance_ns2) -
               logGaussian(innovation_ns, held_.phaseVariance() + variance_ns2);
  changed_.update(to_changed_ns, variance_ns2);
}

PhaseFilter FrequencyTest::changedAt(const PhaseFilter& now) const {
  PhaseFilter changed = changed_;
  changed.predict(now.tick() - changed.tick());
  return changed;
}

}  // namespace probebox::clock
