#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::clock {

// Finds the grid of ticks among edges when only the nominal period is known; edges may be missing, doubled or spurious.
// Chooses the grid with most of the last 32 edges on it, and accepts it only if it explains most edges and has an edge
// at most of its ticks.
class Acquisition {
 public:
  struct Grid {
    MonoTime at{};         // of the last tick with an edge on the grid
    double spread_ns{};    // of the edges around the grid (1.4826 x median of the absolute deviations)
    std::int64_t ticks{};  // from the first tick with an edge to the last, both included
  };

  explicit Acquisition(Nanoseconds nominal_period) : nominal_ns_{nominal_period.count()} {}

  std::optional<Grid> push(MonoTime at);
  void clear() { count_ = 0; }

 private:
  static constexpr std::size_t kEdges = 32;
  struct Support {
    std::size_t reference{};
    std::size_t edges{};
    std::int64_t ticks_with_edge{};
    std::int64_t span{};
  };

  Support supportOf(std::size_t reference) const;
  Grid fit(const Support& support) const;
  double offGrid(std::size_t edge, std::size_t reference, std::int64_t& tick) const;

  std::int64_t nominal_ns_;
  std::array<std::int64_t, kEdges> edges_ns_{};  // oldest first
  std::size_t count_{};
};

}  // namespace probebox::clock
