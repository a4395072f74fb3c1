#include "firmware/procedure/facts/facts.hpp"

#include <algorithm>
#include <span>

namespace probebox::procedure {

double ProbeTools::lengthOf(std::uint32_t number) const {
  for (std::size_t i = 0; i < count; ++i) {
    if (numbers[i] == number) return lengths_mm[i];
  }
  return 0;
}

void ProbeTools::takeLength(std::uint32_t number, double length_mm, std::uint64_t result) {
  for (std::size_t i = 0; i < count; ++i) {
    if (numbers[i] != number) continue;
    lengths_mm[i] = length_mm;
    results[i] = result;
  }
}

double Facts::lengthOf(std::uint32_t probe_tool) const {
  if (probe_shank && probe_shank->tool == probe_tool) return probe_shank->tip_length_mm;
  return probe_tools.lengthOf(probe_tool);
}

double ProbeTools::span_mm() const {
  if (count == 0) return 0;
  const auto [shortest, longest] = std::ranges::minmax(std::span{lengths_mm}.first(count));
  return longest - shortest;
}

}  // namespace probebox::procedure
