#include "drivers/gpio/stamp_lateness.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "drivers/gpio/lines.hpp"

namespace probebox::gpio {
namespace {

// Median of a sorted list; for an even number of values the mean of the two in the middle.
Nanoseconds medianOf(const std::vector<Nanoseconds>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

Nanoseconds robustSigma(const std::vector<Nanoseconds>& values, Nanoseconds median) {
  std::vector<Nanoseconds> distances;
  for (const auto value : values) distances.push_back(value > median ? value - median : median - value);
  std::ranges::sort(distances);
  return Nanoseconds{std::llround(1.4826 * static_cast<double>(medianOf(distances).count()))};
}

}  // namespace

Outcome<StampLateness> stampLateness(std::span<const LoopBackPulse> pulses, const board::LoopBack& lines) {
  std::vector<Nanoseconds> late, brackets;
  for (const auto& pulse : pulses) {
    if (!pulse.stamp) continue;
    late.push_back(*pulse.stamp - pulse.before);
    brackets.push_back(pulse.after - pulse.before);
  }
  const std::size_t lost = pulses.size() - late.size();
  if (late.empty() || 2 * lost > pulses.size()) {
    return Error{std::to_string(lost) + " of " + std::to_string(pulses.size()) +
                 " pulses of the loop-back never came back: is the jumper from " + describe(lines.output) + " to " +
                 describe(lines.input) + " in place?"};
  }
  std::ranges::sort(late);
  std::ranges::sort(brackets);
  const Nanoseconds median = medianOf(late);
  const std::size_t rank99 = (late.size() * 99 + 99) / 100;
  return StampLateness{.pulses = pulses.size(),
                       .lost = lost,
                       .median = median,
                       .p99 = late[rank99 - 1],
                       .largest = late.back(),
                       .bracket = medianOf(brackets),
                       .sigma = robustSigma(late, median)};
}

}  // namespace probebox::gpio
