#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/events/event.hpp"

namespace probebox::io {

// Adds the counts of a secondary axis (U, V or W, parallel to X, Y or Z by ISO 841) to those of its primary axis, at
// the stamps of the latter. Between two stamps of the secondary axis its counts are interpolated linearly, so a count
// waits until the secondary axis has one that is as late. Pure; never allocates.
class SummedCounts {
 public:
  static constexpr std::size_t kKept = 512;  // of each axis: 50 ms at 10 kHz

  // counts_per_count: of the primary axis, for one of the secondary axis; negative where the encoders count in opposite
  // senses.
  explicit SummedCounts(double counts_per_count) : counts_per_count_{counts_per_count} {}

  // Stamps of an axis never go back.
  void pushPrimary(const Count& count);
  void pushSecondary(const Count& count);
  // The next sum, under the sequence number of the primary axis. Counts without one of the secondary axis around their
  // stamp, or in a gap of its own sequence, are left out, and the gap in theirs shows it.
  std::optional<Count> next();
  // Either encoder was lost: what waits has no sum, and what comes begins anew.
  void restart();

 private:
  struct Track {
    std::array<Count, kKept> counts{};
    std::size_t begin{}, end{};

    bool empty() const { return begin == end; }
    const Count& front() const { return counts[begin % kKept]; }
    const Count& back() const { return counts[(end - 1) % kKept]; }
    void push(const Count& count) {
      if (end - begin == kKept) ++begin;
      counts[end++ % kKept] = count;
    }
  };

  double counts_per_count_;
  Track primary_, secondary_;
};

}  // namespace probebox::io
