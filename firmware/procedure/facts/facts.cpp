#include "firmware/procedure/facts/facts.hpp"

#include <algorithm>
#include <span>

namespace probebox::procedure {

std::size_t ProbeTools::placeOf(std::uint32_t number) const {
  const auto own = std::span{numbers}.first(count);
  return static_cast<std::size_t>(std::ranges::find(own, number) - own.begin());
}

double ProbeTools::lengthOf(std::uint32_t number) const {
  const auto at = placeOf(number);
  return at == count ? 0 : lengths_mm[at];
}

double Facts::lengthOf(std::uint32_t probe_tool) const {
  if (probe_shank && probe_shank->tool == probe_tool) return probe_shank->tip_length_mm;
  return probe_tools.lengthOf(probe_tool);
}

double Facts::sdOfLength(std::uint32_t probe_tool) const {
  if (probe_shank && probe_shank->tool == probe_tool) return probe_shank->sd_tip_length_mm;
  const auto at = probe_tools.placeOf(probe_tool);
  return at == probe_tools.count ? 0 : probe_tools.sds_mm[at];
}

std::uint64_t Facts::lengthResultOf(std::uint32_t probe_tool) const {
  if (probe_shank && probe_shank->tool == probe_tool) return probe_shank->tip_result;
  const auto at = probe_tools.placeOf(probe_tool);
  return at == probe_tools.count ? 0 : probe_tools.results[at];
}

void Facts::takeLength(std::uint32_t probe_tool, double length_mm, std::uint64_t result, double sd_mm) {
  if (const auto at = probe_tools.placeOf(probe_tool); at != probe_tools.count) {
    probe_tools.lengths_mm[at] = length_mm;
    probe_tools.sds_mm[at] = sd_mm;
    probe_tools.results[at] = result;
  }
  if (!probe_shank || probe_shank->tool != probe_tool) return;
  probe_shank->tip_length_mm = length_mm;
  probe_shank->sd_tip_length_mm = sd_mm;
  probe_shank->tip_result = result;
}

std::vector<std::uint32_t> Facts::carriers() const {
  std::vector<std::uint32_t> numbers{probe_tools.numbers.begin(), probe_tools.numbers.begin() + probe_tools.count};
  if (probe_shank && std::ranges::find(numbers, probe_shank->tool) == numbers.end())
    numbers.push_back(probe_shank->tool);
  return numbers;
}

const PreTravel* Facts::preTravelOf(std::uint32_t probe_tool) const {
  if (!trigger_probe) return nullptr;
  const auto& all = trigger_probe->pre_travels;
  const auto of = [&](std::uint32_t tool) {
    const auto found = std::ranges::find(all, tool, &PreTravel::tool);
    return found == all.end() ? nullptr : &*found;
  };
  if (const auto* own = of(probe_tool)) return own;
  return carriers() == std::vector{probe_tool} ? of(0) : nullptr;
}

double ProbeTools::span_mm() const {
  if (count == 0) return 0;
  const auto [shortest, longest] = std::ranges::minmax(std::span{lengths_mm}.first(count));
  return longest - shortest;
}

std::optional<double> Facts::sphereReach_mm() const {
  if (!sphere_diameter_mm) return std::nullopt;
  return (*sphere_diameter_mm + stylus_ball_diameter_mm) / 2;
}

}  // namespace probebox::procedure
