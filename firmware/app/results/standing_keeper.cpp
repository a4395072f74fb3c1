#include "firmware/app/results/standing_keeper.hpp"

#include <cmath>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/results_in_force.hpp"

namespace probebox::app {
namespace {

using Correction = std::array<double, kLinearAxes>;

double largestChange(const Correction& a, const Correction& b) {
  double largest = 0;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) largest = std::fmax(largest, std::abs(a[axis] - b[axis]));
  return largest;
}

}  // namespace

std::optional<StandingRestored> StandingKeeper::restore(MonoTime now) {
  const auto standing = store_.standing();
  if (!standing) {
    logError("The last correction sent to the CNC could not be read: " + standing.error().what);
    return std::nullopt;
  }
  if (!*standing) return std::nullopt;
  kept_mm_ = (*standing)->correction_mm;
  return StandingRestored{.correction_mm = *kept_mm_, .at = now};
}

void StandingKeeper::look(const published::Snapshot& snapshot) {
  if (!snapshot.valid) return;
  if (kept_mm_ && largestChange(*kept_mm_, snapshot.correction_mm) <= kLeastChange_mm) return;
  if (tried_at_ && snapshot.at - *tried_at_ < kLeastInterval) return;
  keep(snapshot);
}

void StandingKeeper::finish(const published::Snapshot& snapshot) {
  if (snapshot.valid && kept_mm_ != snapshot.correction_mm) keep(snapshot);
}

void StandingKeeper::keep(const published::Snapshot& snapshot) {
  tried_at_ = snapshot.at;
  if (const auto kept = store_.keepStanding(snapshot.correction_mm, utcNow()); !kept)
    return logError("The correction sent to the CNC could not be stored: " + kept.error().what);
  kept_mm_ = snapshot.correction_mm;
}

}  // namespace probebox::app
