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

std::vector<BoxLine> allLines(const board::Box& box) {
  std::vector<BoxLine> lines{{&box.sync, LineRole::sync, 0}};
  const auto add = [&](const std::vector<board::GpioLine>& of_role, LineRole role) {
    for (std::size_t i = 0; i < of_role.size(); ++i) lines.push_back({&of_role[i], role, static_cast<std::uint8_t>(i)});
  };
  add(box.triggers, LineRole::trigger);
  for (const auto& index : box.indexes) lines.push_back({&index.line, LineRole::index, index.axis});
  add(box.skips, LineRole::skip);
  add(box.inhibits, LineRole::inhibit);
  return lines;
}

std::vector<ChipLines> linesApart(const board::Box& box) {
  auto lines = allLines(box);
  std::erase_if(lines, [](const BoxLine& line) { return line.described->receiver.has_value(); });
  std::vector<ChipLines> apart;
  for (const auto& [described, role, number] : lines) apart.push_back(alone(*described, role, number));
  return apart;
}

}  // namespace probebox::gpio
