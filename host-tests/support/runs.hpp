#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace probebox {

// Whether long tests look at all that they can: where PROBEBOX_RUNS is set (tools/test --all).
inline bool runsAreComplete() {
  static const bool complete = std::getenv("PROBEBOX_RUNS") != nullptr;
  return complete;
}

// Number of simulated runs, places of a disk and the like that a long test looks at: all, or a quarter, at least 8.
inline std::uint64_t runs(std::uint64_t all) {
  return runsAreComplete() ? all : std::min(all, std::max<std::uint64_t>(8, all / 4));
}

}  // namespace probebox
