#include "drivers/usb_probe/input_figures.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace probebox::usb_probe {

// Second differences are free of a deflection that moves slowly; of white noise they have 6 times the variance.
void InputFigures::sample(std::uint8_t run, std::uint32_t counter, const Sample& sample) {
  if (run != run_) risen_.reset();
  if (run != run_ || counter != next_) in_a_row_ = 0;
  run_ = run;
  next_ = counter + 1;
  const bool has_difference = in_a_row_ >= 2;
  for (std::size_t c = 0; c < before_.size(); ++c) {
    const auto nm = sample.channels_nm[c];
    auto& [older, newer] = before_[c];
    const double difference = nm - 2 * newer + older;
    if (has_difference) squares_[c] += difference * difference;
    older = newer;
    newer = nm;
    auto& lowest = now_.lowest_nm[c];
    auto& highest = now_.highest_nm[c];
    lowest = now_.samples == 0 ? nm : std::min(lowest, nm);
    highest = now_.samples == 0 ? nm : std::max(highest, nm);
  }
  if (has_difference) ++differences_;
  ++in_a_row_;
  if ((sample.status & status::kClipped) != 0) ++now_.clipped;
  if (++now_.samples == messages::ReceiverInputs::kWindow) finish();
}

// Whole periods from one rising edge to the next, in steps of the receiver's counter.
void InputFigures::loopBack(std::uint8_t run, std::uint32_t steps_a_sample, const LineEdge& edge) {
  if (edge.level == 0) return;
  const auto before = std::exchange(risen_, edge);
  if (!before || run != run_ || static_cast<std::uint16_t>(edge.sequence - before->sequence) != 2) return;
  const auto instant = [](const LineEdge& at) { return std::uint64_t{at.sample} << 32U | at.fraction; };
  const double samples = std::ldexp(static_cast<double>(instant(edge) - instant(*before)), -32);
  const auto steps = static_cast<std::uint32_t>(std::lround(samples * steps_a_sample));
  now_.shortest_period_steps = now_.loop_back_periods == 0 ? steps : std::min(now_.shortest_period_steps, steps);
  now_.longest_period_steps = std::max(now_.longest_period_steps, steps);
  ++now_.loop_back_periods;
}

void InputFigures::finish() {
  for (std::size_t c = 0; c < squares_.size(); ++c)
    now_.noise_nm[c] = differences_ == 0 ? 0 : std::sqrt(squares_[c] / (6.0 * differences_));
  last_ = now_;
  now_ = {};
  squares_ = {};
  differences_ = 0;
  ++windows_;
}

void InputFigures::restart() {
  now_ = last_ = {};
  squares_ = {};
  differences_ = in_a_row_ = 0;
  risen_.reset();
  ++windows_;
}

}  // namespace probebox::usb_probe
