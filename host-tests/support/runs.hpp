#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace probebox {

// Number of simulated runs that a statistical test looks at: a third of `all`, at least 8; all of them where PROBEBOX_RUNS is set
// (tools/test --all).
inline std::uint64_t runs(std::uint64_t all) {
  static const bool complete = std::getenv("PROBEBOX_RUNS") != nullptr;
  return complete ? all : std::min(all, std::max<std::uint64_t>(8, all / 3));
}

}  // namespace probebox
