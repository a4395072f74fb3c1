#pragma once
#include <cstdint>
#include <span>

namespace probebox::support {

// Information per sample, bits: entropy of the residual of the best linear prediction from the previous 32 samples
// (least squares over the whole column), as a normal distribution of integers.
double innovationBits(std::span<const std::int64_t> column);

}  // namespace probebox::support
