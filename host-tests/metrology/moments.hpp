#pragma once
#include <cmath>
#include <cstddef>
#include <gtest/gtest.h>

#include "firmware/metrology/fit/chi_square.hpp"

namespace probebox::metrology {

// Errors of an estimate against the standard deviation that it states.
struct Moments {
  double squares{};
  double pulls{};
  double sum{};
  std::size_t count{};

  void add(double error, double stated_sd) {
    squares += error * error;
    pulls += (error / stated_sd) * (error / stated_sd);
    sum += error;
    ++count;
  }
  double variance() const { return squares / static_cast<double>(count); }
  double pull() const { return pulls / static_cast<double>(count); }
  // Mean error in standard errors of the mean.
  double bias() const { return sum / std::sqrt(squares); }
};

// Expects stated standard deviations that are neither too small nor too large: the mean square of the pulls must lie in
// the range that chi-square leaves once in 1000 times. independent: number of errors with independent noise.
inline void expectHonest(const Moments& errors, std::size_t independent) {
  const auto range = rangeOf({.dof = independent});
  EXPECT_GT(errors.pull(), range.low) << "the stated sd are too large, by " << errors.count << " errors";
  EXPECT_LT(errors.pull(), range.high) << "the stated sd are too small, by " << errors.count << " errors";
}

inline void expectHonest(const Moments& errors) {
  expectHonest(errors, errors.count);
}

}  // namespace probebox::metrology
