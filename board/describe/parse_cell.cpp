#include <algorithm>

#include "board/describe/cell.hpp"
#include "board/describe/document.hpp"

namespace probebox::board {
namespace {

constexpr Range kLength_mm{1e-3, 50'000};
constexpr std::size_t kMostSolids = 200;
constexpr std::size_t kMostCellTools = 99;

CellSolid readSolid(Section& section, const std::vector<CellSolid>& before) {
  CellSolid solid;
  solid.name = section.text("name");
  const auto same = std::ranges::find(before, solid.name, &CellSolid::name);
  if (section.good("name") && same != before.end())
    section.problem(
        "name",
        "= \"" + solid.name + "\" is used twice: give each solid a name of its own, by which a collision is reported");
  solid.part = static_cast<SolidPart>(section.choice("part", {"machine", "fixture", "workpiece"}));
  solid.shape = static_cast<SolidShape>(section.choice("shape", {"box", "cylinder", "sphere", "stl"}));
  if (solid.shape == SolidShape::box) {
    solid.size_mm = section.vector("size_mm", kLength_mm);
  } else if (solid.shape == SolidShape::mesh) {
    solid.file = section.text("file");
  } else {
    solid.radius_mm = section.number("radius_mm", kLength_mm);
  }
  if (solid.shape == SolidShape::cylinder) solid.height_mm = section.number("height_mm", kLength_mm);
  solid.at_mm = section.vector("at_mm", kPosition_mm);
  solid.turn_deg = section.vectorIfThere("turn_deg", {-360, 360}).value_or(std::array<double, 3>{});
  section.finish();
  return solid;
}

CellTool readTool(Section& section, const std::vector<CellTool>& before) {
  CellTool tool;
  tool.number = static_cast<std::uint32_t>(section.integer("number", {1, 99}));
  if (section.good("number") && std::ranges::find(before, tool.number, &CellTool::number) != before.end())
    section.problem("number",
                    "= " + std::to_string(tool.number) + " is used twice: give each tool a number of its own");
  tool.holder_radius_mm = section.number("holder_radius_mm", {0.1, 500});
  tool.holder_length_mm = section.number("holder_length_mm", {0.1, 1000});
  tool.radius_mm = section.number("radius_mm", {0.01, 500});
  tool.length_mm = section.number("length_mm", {0.1, 1000});
  tool.cutting_mm = section.number("cutting_mm", {0.01, 1000}, tool.length_mm);
  tool.assembled_length_mm = section.numberIfThere("assembled_length_mm", {0.1, 1000});
  if (section.has("offset_mm"))
    section.problem("offset_mm",
                    "has become W1_mm, of the spindle axis from the tip: write it with the opposite signs");
  if (section.has("W1_mm")) {
    const auto across = section.numbers("W1_mm", {-10, 10}, {2, 2});
    if (across.size() == 2) tool.w1_mm = {across[0], across[1]};
  }
  const double shortest = std::min(tool.length_mm, tool.assembled_length_mm.value_or(tool.length_mm));
  if (section.good("cutting_mm") && tool.cutting_mm > shortest)
    section.problem("cutting_mm", "is longer than the tool beyond its holder: give the length of its edges");
  section.finish();
  return tool;
}

Cell readCell(Section& root) {
  Cell cell;
  auto section = root.section("cell");
  cell.name = section.text("name");
  cell.program_zero_mm = section.vectorIfThere("program_zero_mm", kPosition_mm).value_or(std::array<double, 3>{});
  cell.least_mm = section.number("least_mm", {0, 100}, 0);
  section.finish();
  for (auto& solid : root.sections("solid", kMostSolids)) cell.solids.push_back(readSolid(solid, cell.solids));
  for (auto& tool : root.sections("tool", kMostCellTools)) cell.tools.push_back(readTool(tool, cell.tools));
  return cell;
}

}  // namespace

Outcome<Cell> parseCell(std::string_view text, std::string_view file_name) {
  return readDocument<Cell>(text, file_name, readCell);
}

}  // namespace probebox::board
