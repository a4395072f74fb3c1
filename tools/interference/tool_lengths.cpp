#include "tools/interference/scene.hpp"

namespace probebox::interference {

std::string_view nameOf(ToolPart part) {
  switch (part) {
    case ToolPart::cutter:
      return "cutter";
    case ToolPart::shank:
      return "shank";
    case ToolPart::holder:
      return "holder";
  }
  return "tool";
}

Dialect dialectOf(const board::Cell& cell, std::uint32_t tool) {
  Dialect dialect{tool, {}, {}, cell.program_zero_mm};
  for (const auto& one : cell.tools) dialect.tools.push_back(one.number);
  for (const auto& axis : cell.rotary) dialect.rotary[static_cast<std::size_t>(axis.letter)] = true;
  return dialect;
}

Lengths lengthsOf(const board::CellTool& tool) {
  const auto w1_mm = tool.w1_mm.value_or(std::array<double, 2>{});
  return {tool.holder_length_mm,
          tool.assembled_length_mm.value_or(tool.length_mm),
          {0 - w1_mm[0], 0 - w1_mm[1]},
          tool.assembled_length_mm.has_value() || tool.w1_mm.has_value()};
}

}  // namespace probebox::interference
