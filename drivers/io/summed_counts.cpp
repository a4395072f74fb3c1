#include "drivers/io/summed_counts.hpp"

#include <cmath>

namespace probebox::io {

void SummedCounts::pushPrimary(const Count& count) {
  primary_.push(count);
}

void SummedCounts::pushSecondary(const Count& count) {
  secondary_.push(count);
}

std::optional<Count> SummedCounts::next() {
  while (!primary_.empty() && !secondary_.empty()) {
    Count sum = primary_.front();
    if (secondary_.back().at < sum.at) return std::nullopt;
    // The pair about that stamp.
    while (secondary_.end - secondary_.begin > 1 && secondary_.counts[(secondary_.begin + 1) % kKept].at <= sum.at)
      ++secondary_.begin;
    ++primary_.begin;
    const Count& before = secondary_.front();
    if (before.at > sum.at) continue;
    double counts = 0;
    if (before.at < sum.at) {
      const Count& after = secondary_.counts[(secondary_.begin + 1) % kKept];
      if (after.sequence != before.sequence + 1) continue;
      const double share =
          static_cast<double>((sum.at - before.at).count()) / static_cast<double>((after.at - before.at).count());
      counts = share * static_cast<double>(after.counts - before.counts);
    }
    counts += static_cast<double>(before.counts);
    sum.counts += std::llround(counts_per_count_ * counts);
    return sum;
  }
  return std::nullopt;
}

void SummedCounts::restart() {
  primary_.begin = primary_.end;
  secondary_.begin = secondary_.end;
}

}  // namespace probebox::io
