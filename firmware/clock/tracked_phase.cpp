#include "firmware/clock/tracked_phase.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace probebox::clock {
namespace {

constexpr std::int64_t kSettleAtLeast = 32;  // stamps
constexpr double kSettledPpm = 20;           // sigma of the frequency
constexpr double kJudgedPpm = 1;             // the same where the frequency is close to the limit
// A possible frequency change in a gap: none in the first half second, all of holdover_ppm after a second. No crystal's
// temperature follows faster, and the learned walk has the rest.
constexpr double kHeldSeconds = 0.5;
constexpr double kDriftedSeconds = 1;

Nanoseconds wholeNanoseconds(double period_ns) {
  return Nanoseconds{std::llround(period_ns)};
}

}  // namespace

TrackedPhase::TrackedPhase(const Config& config)
    : config_{config},
      rounding_ns_{config.period_ns - static_cast<double>(wholeNanoseconds(config.period_ns).count())},
      filter_{wholeNanoseconds(config.period_ns)},
      jitter_{static_cast<double>(config.jitter.count()), config.learns},
      wander_{wholeNanoseconds(config.period_ns), config.phase_wander_ns_per_sqrt_s,
              config.frequency_wander_ppb_per_sqrt_s},
      unmoved_{filter_},
      predicted_{filter_} {
  filter_.setWalk(wander_.walk());
}

void TrackedPhase::forgetJitter() {
  jitter_ = Jitter{static_cast<double>(config_.jitter.count()), config_.learns};
}

void TrackedPhase::forgetWalks() {
  wander_.forget();
  filter_.setWalk(wander_.walk());
  unmoved_.setWalk(wander_.walk());
}

void TrackedPhase::start(Tick tick, MonoTime at, double phase_sigma_ns, double drift_ns, double drift_sigma_ns) {
  filter_.start(tick, at, phase_sigma_ns, drift_ns, drift_sigma_ns);
  settled_ = 0;
  wander_.restart();
  jump_test_.end();
  frequency_test_.end();
  untested_gap_ = 0;
}

Jitter::Judgement TrackedPhase::take(const Stamp& stamp) {
  filter_.predict(stamp.ahead);
  if (stamp.after_holdover) hold(stamp);
  if (stamp.tests_line) beginJumpTest();
  const double phase_variance = filter_.phaseVariance();
  const Jitter::Judgement judged = jitter_.judge(stamp.residual_ns, phase_variance);
  const bool was_learned = jitter_.learned();
  jitter_.track(stamp.residual_ns, phase_variance, judged, stamp.since_last);
  if (jitter_.learned() != was_learned) wander_.restart();
  const bool is_doubted = jump_test_.running() && jump_test_.jumped();
  if (stamp.walks && !is_doubted) learnWalks(judged);
  // Stamps that follow another line, in doubt, say nothing about the frequency of the held one.
  const bool tests_frequency = frequency_test_.running() && !is_doubted;
  if (jump_test_.running() || tests_frequency) predicted_ = filter_;
  filter_.update(judged.innovation_ns, judged.variance_ns2);
  if (tests_frequency) testFrequency(judged);
  if (jump_test_.running()) testForJump(stamp.residual_ns);
  return judged;
}

// Takes into account that the frequency may have changed in a long gap.
void TrackedPhase::hold(const Stamp& stamp) {
  const double drift_sigma_ns = heldDriftSigmaNs(stamp.ahead);
  if (drift_sigma_ns == 0) return;
  wander_.restart();
  if (stamp.tests_line) {
    untested_gap_ = stamp.ahead;
  } else {
    filter_.loosen(drift_sigma_ns, stamp.ahead);
  }
}

void TrackedPhase::learnWalks(const Jitter::Judgement& judged) {
  const bool has_learned =
      wander_.push(filter_.tick(), filter_.at(), filter_.subNanosecond() + judged.innovation_ns, judged.variance_ns2);
  if (!has_learned || !config_.learns) return;
  filter_.setWalk(wander_.walk());
  unmoved_.setWalk(wander_.walk());
  frequency_test_.setWalk(wander_.walk());
}

// A test that another gap interrupts keeps its opinion.
void TrackedPhase::beginJumpTest() {
  if (jump_test_.running() && jump_test_.jumped()) wander_.restart();
  jump_test_.begin(filter_);
}

// Both hypotheses are kept up to date until the test has ended.
void TrackedPhase::testForJump(double residual_ns) {
  if (jump_test_.jumped()) {
    unmoved_.predict(predicted_.tick() - unmoved_.tick());
    const auto judged = jitter_.judge(residual_ns + predicted_.aheadOf(unmoved_), unmoved_.phaseVariance());
    unmoved_.update(judged.innovation_ns, judged.variance_ns2);
  }
  if (jump_test_.push(predicted_, residual_ns, jitter_)) followJump(jump_test_.jumped());
  if (jump_test_.running()) return;
  if (jump_test_.jumped()) {
    wander_.restart();
    frequency_test_.end();
  }
  if (untested_gap_ > 0) beginFrequencyTest();
}

// Follows the line that the residuals since the gap make more likely: one that begins anew where they are, or the held
// one.
void TrackedPhase::followJump(bool jumped) {
  if (!jumped) {
    filter_ = unmoved_;
    return;
  }
  unmoved_ = filter_;
  const PhaseFilter& held = jump_test_.held();
  filter_.start(held.tick(), held.timeOf(0) + Nanoseconds{std::llround(jump_test_.shiftNs())},
                jump_test_.shiftSigmaNs(), held.drift(), holdoverDriftSigmaNs());
}

// A jump has opened the frequency already.
void TrackedPhase::beginFrequencyTest() {
  const std::int64_t gap = std::exchange(untested_gap_, 0);
  if (jump_test_.jumped()) return;
  frequency_test_.begin(jump_test_.held(), gap, ppmToNs(config_.holdover_ppm), jump_test_.shiftNs(),
                        jump_test_.shiftSigmaNs());
}

void TrackedPhase::testFrequency(const Jitter::Judgement& judged) {
  if (!frequency_test_.push(predicted_, judged.innovation_ns, judged.variance_ns2)) return;
  filter_ = frequency_test_.changedAt(filter_);
  jump_test_.end();
  untested_gap_ = 0;
  wander_.restart();
}

TrackedPhase::Frequency TrackedPhase::settle() {
  ++settled_;
  const double sigma_ppm = std::sqrt(filter_.driftVariance()) / ppmToNs(1);
  if (settled_ < kSettleAtLeast || sigma_ppm > kSettledPpm) return Frequency::uncertain;
  const double over_ppm = std::abs(offsetPpm()) - config_.max_ppm;
  const bool is_close = std::abs(over_ppm) < 3 * sigma_ppm && sigma_ppm > kJudgedPpm;
  if (is_close) return Frequency::uncertain;
  return over_ppm > 0 ? Frequency::refused : Frequency::within_limit;
}

bool TrackedPhase::beyondLimit() const {
  return std::abs(driftNs()) > ppmToNs(config_.max_ppm);
}

double TrackedPhase::sigmaNs(std::int64_t ahead, bool in_holdover) const {
  if (!in_holdover) return heldSigmaNs(ahead);
  return std::hypot(heldSigmaNs(ahead), heldDriftSigmaNs(ahead) * static_cast<double>(ahead));
}

double TrackedPhase::heldSigmaNs(std::int64_t ahead) const {
  return std::sqrt(std::max(0.0, filter_.phaseVariance(ahead)));
}

// Possible change of the frequency in a gap of so many ticks, ns per tick.
double TrackedPhase::heldDriftSigmaNs(std::int64_t ahead) const {
  const double seconds = static_cast<double>(ahead) * config_.period_ns * 1e-9;
  const double share = std::clamp((seconds - kHeldSeconds) / (kDriftedSeconds - kHeldSeconds), 0.0, 1.0);
  return share * ppmToNs(config_.holdover_ppm);
}

double TrackedPhase::holdoverDriftSigmaNs() const {
  return std::hypot(std::sqrt(filter_.driftVariance()), ppmToNs(config_.holdover_ppm));
}

}  // namespace probebox::clock
