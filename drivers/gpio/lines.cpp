#include "drivers/gpio/lines.hpp"

namespace probebox::gpio {
namespace {

ChipLines alone(const board::GpioLine& line, LineRole role, std::uint8_t index) {
  return {line.chip, {{line.name, line.line, {0, role, index, line.active, edgesOf(role)}}}};
}

}  // namespace

std::string lineText(const board::LineAddress& address, const std::string& name) {
  const auto* const offset = std::get_if<unsigned>(&address);
  const auto place = offset != nullptr ? std::to_string(*offset) : "\"" + std::get<std::string>(address) + "\"";
  return "line " + place + " (" + name + ")";
}

std::string describe(const board::GpioLine& line) {
  return line.chip + " " + lineText(line.line, line.name);
}

std::vector<ChipLines> linesApart(const board::Box& box) {
  std::vector<ChipLines> lines{alone(box.sync, LineRole::sync, 0)};
  std::uint8_t index = 0;
  for (const auto& line : box.triggers) lines.push_back(alone(line, LineRole::trigger, index++));
  for (const auto& [line, axis] : box.indexes) lines.push_back(alone(line, LineRole::index, axis));
  index = 0;
  for (const auto& line : box.skips) lines.push_back(alone(line, LineRole::skip, index++));
  index = 0;
  for (const auto& line : box.inhibits) lines.push_back(alone(line, LineRole::inhibit, index++));
  return lines;
}

}  // namespace probebox::gpio
