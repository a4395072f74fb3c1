#include "counters_and_converter.hpp"

#include <utility>

namespace probebox::vm {

// A value is that of the instant before it is latched, and the kernel stamps the latch: what lies between is
// microseconds.
void CountersAndConverter::play(const world::Machine& machine) {
  for (std::size_t input = 0; input < counters_.size(); ++input) {
    auto& counter = counters_[input];
    if (!counter.isPlugged()) continue;
    counter.count(wiring.sense[input] * truth_.counts(machine, wiring.axis_at_input[input], kernelNow()));
    counter.capture();
  }
  passMark(machine, kernelNow());
  if (converter_.isPlugged()) converter_.convert(truth_.channels(machine, kernelNow()));
}

void CountersAndConverter::passMark(const world::Machine& machine, MonoTime at) {
  const double before_mm = std::exchange(x_mm_, machine.positionAt(at)[0]);
  const bool passed = (before_mm < Truth::kMark_mm) != (x_mm_ < Truth::kMark_mm);
  if (passed && wiring.index && counters_[0].isPlugged()) counters_[0].index();
}

}  // namespace probebox::vm
