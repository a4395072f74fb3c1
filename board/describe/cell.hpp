#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/describe/machine.hpp"
#include "protocol/units/outcome.hpp"

// Describes the surroundings of the tool as simple solids or STL (cell.toml), mm, machine axes, with all rotary axes
// at 0. For pictures and interference checks only.
namespace probebox::board {

// What a rotary axis turns: the solids that name it (a table), or the tool (a head).
enum class Carries : std::uint8_t { solids, tool };

struct CellRotary {
  RotaryLetter letter{};
  Carries carries{};
  std::array<double, 3> direction{};  // unit vector: a positive angle is right-handed about it
  std::array<double, 3>
      through_mm{};  // a point on it; of a head from the middle of the gauge line, as a control has it
};

enum class SolidPart : std::uint8_t { machine, fixture, workpiece };
enum class SolidShape : std::uint8_t { box, cylinder, sphere, mesh };

struct CellSolid {
  std::string name;
  SolidPart part{};
  SolidShape shape{};
  std::array<double, 3> size_mm{};        // of a box, along its own axes
  double radius_mm{};                     // of a cylinder, whose axis is its own Z, or a sphere
  double height_mm{};                     // of a cylinder
  std::string file;                       // of a mesh: STL, beside cell.toml
  std::optional<double> unit_mm;          // of the numbers in it, which it does not state
  std::array<double, 3> at_mm{};          // position of its middle; for a mesh, of its origin
  std::array<double, 3> turn_deg{};       // about X, then Y, then Z of the machine
  std::optional<std::size_t> moves_with;  // place in Cell::rotary of the axis that carries it
};

// A tool in its holder, rotationally symmetric about Z, with the spindle above.
struct CellTool {
  std::uint32_t number{};
  double holder_radius_mm{}, holder_length_mm{}, radius_mm{}, length_mm{};
  double cutting_mm{};
  std::optional<double> assembled_length_mm;
  std::optional<std::array<double, 2>> w1_mm;  // as measured: of the spindle axis from the tip (C3)

  static constexpr void keys(auto& self, auto&& key) {
    key("number", self.number, within(1, 99), "of the tool");
    key("holder_radius_mm", self.holder_radius_mm, within(0.1, 500), "of the holder");
    key("holder_length_mm", self.holder_length_mm, within(0.1, 1000), "from the gauge line to its face, L1");
    key("radius_mm", self.radius_mm, within(0.01, 500), "of the tool");
    key("length_mm", self.length_mm, within(0.1, 1000), "from the holder's face to the tip, as stored");
    key("cutting_mm", self.cutting_mm, within(0.01, 1000).orUsual(),
        "of the edges, from the tip on, which may touch the workpiece; omitted: the length");
    key("assembled_length_mm", self.assembled_length_mm, within(0.1, 1000), "the length as measured, L3");
  }
};

struct Cell {
  std::string name;
  std::array<double, 3> program_zero_mm{};
  double least_mm{};
  std::vector<CellRotary> rotary;  // those of the table, and those of the head, each from the base outwards
  std::vector<CellSolid> solids;
  std::vector<CellTool> tools;

  static constexpr void keys(auto& self, auto&& key) {
    key("name", self.name, kAnyText, "of the cell");
    key("program_zero_mm", self.program_zero_mm, within(kPosition_mm).orUsual(),
        "machine coordinates of the program's zero");
    key("least_mm", self.least_mm, within(0, 100).orUsual(), "a smaller distance is a hit");
  }
};

// Reads strictly, as the other descriptions. file_name: for messages.
Outcome<Cell> parseCell(std::string_view text, std::string_view file_name);

}  // namespace probebox::board
