#pragma once
#include <vector>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// A stream without the samples that cannot be motion: those that miss what both neighbours on the left, both on the
// right and the two beside them say, all to the same side, by more than twenty deviations of one sample. Kinks, ramps
// and steps pass: there one side agrees. jitter_s: of the stamps, which takes samples of a fast motion off their
// neighbours.
struct Despiked {
  Stream stream;
  std::vector<double> removed;  // stamps, s
};
Despiked withoutSpikes(const Stream& stream, double jitter_s);

}  // namespace probebox::metrology
