#include "counters_and_converter.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace probebox::vm {
namespace {

constexpr std::size_t kZ = 2;

// At most 16 mm/s: a millisecond is 16 um.
double quillAt_mm(MonoTime at) {
  return 5 * std::sin(std::numbers::pi * toSeconds(at.time_since_epoch()));
}

}  // namespace

// A value is that of the instant before it is latched, and the kernel stamps the latch: what lies between is
// microseconds.
void CountersAndConverter::play(const world::Machine& machine) {
  for (std::size_t input = 0; input < counters_.size(); ++input) {
    auto& counter = counters_[input];
    if (!counter.isPlugged()) continue;
    counter.count(countsAt(machine, input, kernelNow()));
    counter.capture();
  }
  if (quill_ && quill_->isPlugged()) {
    quill_->count(std::llround(kQuillCountsPerMm * quillAt_mm(kernelNow())));
    quill_->capture();
  }
  passMark(machine, kernelNow());
  if (converter_.isPlugged()) converter_.convert(truth_.channels(machine, kernelNow()));
}

std::int64_t CountersAndConverter::countsAt(const world::Machine& machine, std::size_t input, MonoTime at) {
  const auto axis = wiring.axis_at_input[input];
  const auto of_quill = quill_ && axis == kZ ? std::llround(Truth::kCountsPerMm * quillAt_mm(at)) : 0;
  return wiring.sense[input] * (truth_.counts(machine, axis, at) - of_quill);
}

void CountersAndConverter::passMark(const world::Machine& machine, MonoTime at) {
  const double before_mm = std::exchange(x_mm_, machine.positionAt(at)[0]);
  const bool passed = (before_mm < Truth::kMark_mm) != (x_mm_ < Truth::kMark_mm);
  if (passed && wiring.index && counters_[0].isPlugged()) counters_[0].index();
}

}  // namespace probebox::vm
