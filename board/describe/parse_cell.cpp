#include <algorithm>
#include <cmath>

#include "board/describe/cell.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

constexpr Range kLength_mm{1e-3, 50'000};
constexpr std::size_t kMostSolids = 200;
constexpr std::size_t kMostCellTools = 99;

constexpr std::string_view kRotaryNames = "ABC";

char nameOf(const CellRotary& axis) {
  return kRotaryNames[static_cast<std::size_t>(axis.letter)];
}

CellRotary readCellRotary(Section& section, const std::vector<CellRotary>& before) {
  CellRotary axis;
  axis.letter = static_cast<RotaryLetter>(section.choice("letter", {"A", "B", "C"}));
  if (section.good("letter") && std::ranges::find(before, axis.letter, &CellRotary::letter) != before.end())
    section.problem("letter", std::string{"= \""} + nameOf(axis) + "\" is used twice: describe each axis once");
  axis.carries = static_cast<Carries>(section.choice("carries", {"solids", "tool"}));
  // ISO 841: A turns about X, B about Y, C about Z.
  std::array<double, 3> usual{};
  usual[static_cast<std::size_t>(axis.letter)] = 1;
  axis.direction = section.vectorIfThere("direction", {-1, 1}).value_or(usual);
  const double length = std::hypot(axis.direction[0], axis.direction[1], axis.direction[2]);
  if (section.good("direction") && length < 1e-3)
    section.problem("direction", "has no length: write where the axis points, such as [0, 1, 0]");
  for (auto& part : axis.direction) part /= std::max(length, 1e-3);
  axis.through_mm = section.vector("through_mm", kPosition_mm);
  section.finish();
  return axis;
}

// The place of the axis that carries a solid.
std::optional<std::size_t> readCarrier(Section& section, const std::vector<CellRotary>& rotary) {
  if (!section.has("moves_with")) return std::nullopt;
  const auto letter = static_cast<RotaryLetter>(section.choice("moves_with", {"A", "B", "C"}));
  const auto found = std::ranges::find(rotary, letter, &CellRotary::letter);
  if (section.good("moves_with") && (found == rotary.end() || found->carries != Carries::solids)) {
    section.problem("moves_with", std::string{"names the axis "} + kRotaryNames[static_cast<std::size_t>(letter)] +
                                      ", which is no [[rotary_axis]] with carries = \"solids\": describe it there");
    return std::nullopt;
  }
  return found == rotary.end() ? std::nullopt : std::optional{static_cast<std::size_t>(found - rotary.begin())};
}

CellSolid readSolid(Section& section, const std::vector<CellSolid>& before, const std::vector<CellRotary>& rotary) {
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
    constexpr std::array kUnits_mm{1.0, 25.4, 1000.0};
    if (section.has("unit")) solid.unit_mm = kUnits_mm[section.choice("unit", {"mm", "inch", "m"})];
  } else {
    solid.radius_mm = section.number("radius_mm", kLength_mm);
  }
  if (solid.shape == SolidShape::cylinder) solid.height_mm = section.number("height_mm", kLength_mm);
  solid.at_mm = section.vector("at_mm", kPosition_mm);
  solid.turn_deg = section.vectorIfThere("turn_deg", {-360, 360}).value_or(std::array<double, 3>{});
  solid.moves_with = readCarrier(section, rotary);
  section.finish();
  return solid;
}

CellTool readTool(Section& section, const std::vector<CellTool>& before) {
  CellTool tool;
  readKeys(section, tool);
  if (!section.has("cutting_mm")) tool.cutting_mm = tool.length_mm;
  if (section.good("number") && std::ranges::find(before, tool.number, &CellTool::number) != before.end())
    section.problem("number",
                    "= " + std::to_string(tool.number) + " is used twice: give each tool a number of its own");
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
  auto cell = read<Cell>(root.section("cell"));
  for (auto& axis : root.sections("rotary_axis", kRotaryNames.size()))
    cell.rotary.push_back(readCellRotary(axis, cell.rotary));
  for (auto& solid : root.sections("solid", kMostSolids))
    cell.solids.push_back(readSolid(solid, cell.solids, cell.rotary));
  for (auto& tool : root.sections("tool", kMostCellTools)) cell.tools.push_back(readTool(tool, cell.tools));
  return cell;
}

}  // namespace

Outcome<Cell> parseCell(std::string_view text, std::string_view file_name) {
  return readDocument<Cell>(text, file_name, readCell);
}

}  // namespace probebox::board
