#include "firmware/clock/wander.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::clock {
namespace {

constexpr double kBlockSeconds = 0.12;
constexpr double kSmallestPhase = 1.0;      // ns/sqrt(s), at step 1
constexpr double kSmallestFrequency = 0.3;  // ppb/sqrt(s), at step 0
constexpr int kPhaseSteps = 28;
constexpr int kFrequencySteps = 34;

double amplitude(double smallest, int steps) {
  return smallest * std::exp2(0.5 * steps);
}

// A few seconds cannot tell a small wander from none, and a filter that believes in none stops following: without
// evidence the walks stay near what they were. Standard deviation of that belief, in steps.
constexpr double kInertia = 2;

int stepsOf(double value, double smallest) {
  return static_cast<int>(std::lround(2 * std::log2(value / smallest)));
}

}  // namespace

Wander::Wander(Nanoseconds nominal_period, double phase_ns_per_sqrt_s, double frequency_ppb_per_sqrt_s)
    : nominal_ns_{nominal_period.count()},
      period_s_{toSeconds(nominal_period)},
      ticks_per_block_{std::max<std::int64_t>(1, std::llround(kBlockSeconds / toSeconds(nominal_period)))} {
  const double phase = std::max(phase_ns_per_sqrt_s, 1e-3);
  const double frequency = std::max(frequency_ppb_per_sqrt_s, 1e-3);
  best_ = {std::clamp(stepsOf(phase, kSmallestPhase) + 1, 0, kPhaseSteps),
           std::clamp(stepsOf(frequency, kSmallestFrequency), 0, kFrequencySteps)};
  believed_ = stated_ = best_;
}

void Wander::forget() {
  best_ = stated_;
  restart();
}

void Wander::restart() {
  block_count_ = 0;
  in_block_ = {};
  next_look_ = kFirstLook;
  search_.reset();
  believed_ = best_;
}

double Wander::frequencyPpbPerSqrtS() const {
  return amplitude(kSmallestFrequency, best_.frequency);
}

PhaseFilter::Walk Wander::walkOf(Choice choice) const {
  const double phase = choice.phase == 0 ? 0 : amplitude(kSmallestPhase, choice.phase - 1);
  const double frequency = amplitude(kSmallestFrequency, choice.frequency) * 1e-9 * static_cast<double>(nominal_ns_);
  return {phase * phase * period_s_, frequency * frequency * period_s_};
}

bool Wander::push(Tick tick, MonoTime at, double beyond_ns, double variance_ns2) {
  if (search_) return search();
  if (block_count_ == 0 && in_block_.count == 0) {
    origin_ = tick;
    origin_at_ = at;
    block_end_ = ticks_per_block_;
  }
  const std::int64_t ticks = tick - origin_;
  if (ticks >= block_end_) {
    closeBlock();
    block_end_ += (1 + (ticks - block_end_) / ticks_per_block_) * ticks_per_block_;
  }
  in_block_.tick += static_cast<double>(ticks);
  in_block_.phase_ns += static_cast<double>((at - origin_at_).count() - ticks * nominal_ns_) + beyond_ns;
  in_block_.count += 1;
  in_block_.variance_ns2 += variance_ns2;
  return false;
}

void Wander::closeBlock() {
  if (in_block_.count > 0) {
    const double n = in_block_.count;
    blocks_[block_count_++] = {in_block_.tick / n, in_block_.phase_ns / n, n, in_block_.variance_ns2 / (n * n)};
  }
  in_block_ = {};
  if (block_count_ == next_look_) search_ = Search{.centre = best_};
}

// One step of a descent over the grid of walks: first the centre, then its eight neighbours, then on to the best of
// them.
bool Wander::search() {
  Search& search = *search_;
  if (!search.centre_is_known) {
    search.best_likelihood = plausibility(search.centre);
    search.best = search.centre;
    search.centre_is_known = true;
    return false;
  }
  if (search.neighbour < 9) {
    const Choice choice{search.centre.phase + search.neighbour / 3 - 1,
                        search.centre.frequency + search.neighbour % 3 - 1};
    ++search.neighbour;
    const bool on_grid = choice.phase >= 0 && choice.phase <= kPhaseSteps && choice.frequency >= 0 &&
                         choice.frequency <= kFrequencySteps;
    if (!on_grid || choice == search.centre) return false;
    const double likelihood = plausibility(choice);
    if (likelihood > search.best_likelihood) {
      search.best_likelihood = likelihood;
      search.best = choice;
    }
    return false;
  }
  if (search.best != search.centre) {
    search = {.centre = search.best,

              .centre_is_known = true,
              .best = search.best,
              .best_likelihood = search.best_likelihood};
    return false;
  }
  best_ = search.best;
  search_.reset();
  in_block_ = {};
  const bool all_blocks_seen = next_look_ == kBlocks;
  if (all_blocks_seen) {
    // The walks are known now: a few blocks would only add their noise.
    restart();
    next_look_ = kBlocks / 2;
  } else {
    next_look_ *= 2;
  }
  return true;
}

double Wander::plausibility(Choice choice) const {
  const double phase_steps = (choice.phase - believed_.phase) / kInertia;
  const double frequency_steps = (choice.frequency - believed_.frequency) / kInertia;
  return logLikelihood(walkOf(choice)) - 0.5 * (phase_steps * phase_steps + frequency_steps * frequency_steps);
}

// Log likelihood of the blocks' phases under a walk, by prediction error decomposition.
double Wander::logLikelihood(PhaseFilter::Walk walk) const {
  double phase = blocks_[0].phase_ns;
  double drift = (blocks_[1].phase_ns - blocks_[0].phase_ns) / (blocks_[1].tick - blocks_[0].tick);
  const double first_variance = blocks_[0].variance_ns2;
  double p00 = first_variance;
  double p01 = 0;
  double p11 = 1e4 * first_variance;
  double sum = 0;
  for (std::size_t i = 1; i < block_count_; ++i) {
    const double n = blocks_[i].tick - blocks_[i - 1].tick;
    phase += n * drift;
    p00 += n * (2 * p01 + n * p11 + walk.phase_ns2 + walk.frequency_ns2 * n * n / 3);
    p01 += n * p11 + walk.frequency_ns2 * n * n / 2;
    p11 += walk.frequency_ns2 * n;
    const double innovation = blocks_[i].phase_ns - phase;
    const double total = p00 + blocks_[i].variance_ns2;
    // The first blocks only settle the state.
    if (i > 2) sum -= 0.5 * (std::log(total) + innovation * innovation / total);
    const double phase_gain = p00 / total;
    const double drift_gain = p01 / total;
    phase += phase_gain * innovation;
    drift += drift_gain * innovation;
    p11 -= drift_gain * p01;
    p01 -= drift_gain * p00;
    p00 -= phase_gain * p00;
  }
  return sum;
}

}  // namespace probebox::clock
