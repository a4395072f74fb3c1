#include "drivers/gpio/lines.hpp"

#include <algorithm>

namespace probebox::gpio {
namespace {

void add(std::vector<ChipLines>& chips, const board::GpioLine& line, LineRole role, std::uint8_t index) {
  auto chip = std::find_if(chips.begin(), chips.end(), [&](const ChipLines& known) { return known.chip == line.chip; });
  if (chip == chips.end()) chip = chips.insert(chips.end(), ChipLines{line.chip, {}});
  chip->lines.push_back({line.name, line.line, {0, role, index, line.active, edgesOf(role)}});
}

}  // namespace

std::vector<ChipLines> linesByChip(const board::Box& box) {
  std::vector<ChipLines> chips;
  add(chips, box.sync, LineRole::sync, 0);
  std::uint8_t index = 0;
  for (const auto& line : box.triggers) add(chips, line, LineRole::trigger, index++);
  for (const auto& [line, axis] : box.indexes) add(chips, line, LineRole::index, axis);
  index = 0;
  for (const auto& line : box.skips) add(chips, line, LineRole::skip, index++);
  return chips;
}

}  // namespace probebox::gpio
