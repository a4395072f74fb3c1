#pragma once
#include <vector>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Removes samples that cannot be motion: those that deviate from the extrapolation of both left neighbours, of both
// right neighbours and from the interpolation of the two adjacent ones, all in the same direction, by more than twenty
// sd of a sample; of the first and the last two those that the samples on their one side miss by sixty. Kinks, ramps
// and steps agree with one side and are kept. jitter_s: sd of the stamps, which moves samples of a fast motion.
struct Despiked {
  Stream stream;
  std::vector<double> removed;  // stamps, s
};
Despiked withoutSpikes(const Stream& stream, double jitter_s);

}  // namespace probebox::metrology
