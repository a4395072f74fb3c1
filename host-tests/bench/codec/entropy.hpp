#pragma once
#include <cstdint>
#include <span>

namespace probebox::bench {

// What is new in every sample, in bits: the entropy of the residual of the best linear prediction from the 32 samples
// before (least squares over the whole column), taken as a normal distribution of integers.
double innovationBits(std::span<const std::int64_t> column);

}  // namespace probebox::bench
