#include "firmware/clock/acquisition.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "firmware/clock/statistics.hpp"

namespace probebox::clock {
namespace {

// Fraction of a period that an edge may be off the grid: room for jitter, and for 200 ppm over 32 edges.
constexpr double kTolerance = 0.12;

}  // namespace

std::optional<Acquisition::Grid> Acquisition::push(MonoTime at) {
  const bool backwards = count_ > 0 && toNs(at) < edges_ns_[count_ - 1];
  if (backwards) clear();
  if (count_ == kEdges) {
    std::shift_left(edges_ns_.begin(), edges_ns_.end(), 1);
    --count_;
  }
  edges_ns_[count_++] = toNs(at);
  if (count_ < kEdges) return std::nullopt;

  Support best;
  for (std::size_t reference = 0; reference < kEdges; ++reference) {
    const Support support = supportOf(reference);
    if (support.ticks_with_edge > best.ticks_with_edge) best = support;
  }
  const bool explains_most_edges = best.edges * 5 >= kEdges * 3;
  const bool most_ticks_have_one = best.ticks_with_edge * 5 >= best.span * 3 && best.ticks_with_edge >= 12;
  // A grid is read at its newest edge, so the newest edge has to be on it.
  std::int64_t tick = 0;
  const bool ends_on_grid = std::abs(offGrid(kEdges - 1, best.reference, tick)) < kTolerance;
  if (!explains_most_edges || !most_ticks_have_one || !ends_on_grid) return std::nullopt;
  return fit(best);
}

// How far the edge is from the reference's grid, in periods, and at which of its ticks.
double Acquisition::offGrid(std::size_t edge, std::size_t reference, std::int64_t& tick) const {
  const double periods = static_cast<double>(edges_ns_[edge] - edges_ns_[reference]) / static_cast<double>(nominal_ns_);
  tick = std::llround(periods);
  return periods - static_cast<double>(tick);
}

Acquisition::Support Acquisition::supportOf(std::size_t reference) const {
  Support support{.reference = reference};
  std::int64_t first = 0;
  std::int64_t last = 0;
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    std::int64_t tick = 0;
    if (std::abs(offGrid(edge, reference, tick)) >= kTolerance) continue;
    if (support.edges == 0) first = tick;
    if (support.edges == 0 || tick != last) ++support.ticks_with_edge;
    ++support.edges;
    last = tick;
  }
  support.span = last - first + 1;
  return support;
}

Acquisition::Grid Acquisition::fit(const Support& support) const {
  std::array<double, kEdges> deviations{};
  std::size_t used = 0;
  std::int64_t tick = 0;
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    const double off = offGrid(edge, support.reference, tick) * static_cast<double>(nominal_ns_);
    if (std::abs(off) < kTolerance * static_cast<double>(nominal_ns_)) deviations[used++] = off;
  }
  const std::span on_grid{deviations.data(), used};
  const double centre = median(on_grid);
  for (double& deviation : on_grid) deviation = std::abs(deviation - centre);
  const std::int64_t at = edges_ns_[support.reference] + tick * nominal_ns_ + std::llround(centre);
  return {monoTime(at), 1.4826 * median(on_grid), support.span};
}

}  // namespace probebox::clock
