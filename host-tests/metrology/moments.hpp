#pragma once
#include <cmath>
#include <cstddef>

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

}  // namespace probebox::metrology
