#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace probebox {

// Whether statistical tests look at all of their simulated runs: where PROBEBOX_RUNS is set (tools/test --all).
inline bool runsAreComplete() {
  static const bool complete = std::getenv("PROBEBOX_RUNS") != nullptr;
  return complete;
}

// Number of simulated runs that a statistical test looks at: all, or a third, at least 8.
inline std::uint64_t runs(std::uint64_t all) {
  return runsAreComplete() ? all : std::min(all, std::max<std::uint64_t>(8, all / 3));
}

}  // namespace probebox
