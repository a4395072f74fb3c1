#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

// cell.toml: what stands around the tool, as simple solids or STL. mm, machine axes; for pictures and interference
// only.
namespace probebox::board {

enum class SolidPart : std::uint8_t { machine, fixture, workpiece };
enum class SolidShape : std::uint8_t { box, cylinder, sphere, mesh };

struct CellSolid {
  std::string name;
  SolidPart part{};
  SolidShape shape{};
  std::array<double, 3> size_mm{};   // of a box, along its own axes
  double radius_mm{};                // of a cylinder, whose axis is its own Z, or a sphere
  double height_mm{};                // of a cylinder
  std::string file;                  // of a mesh: STL, beside cell.toml
  std::array<double, 3> at_mm{};     // its middle; of a mesh its own origin
  std::array<double, 3> turn_deg{};  // about X, then Y, then Z of the machine
};

// A tool in its holder, round about Z, the spindle above.
struct CellTool {
  std::uint32_t number{};
  double holder_radius_mm{};
  double holder_length_mm{};  // from the gauge line to its face, L1
  double radius_mm{};
  double length_mm{};                              // from the holder's face to the tip, as the store has it
  double cutting_mm{};                             // of it, from the tip on: may touch the workpiece in feed
  std::optional<double> assembled_length_mm;       // the same as it was measured, L3
  std::optional<std::array<double, 2>> offset_mm;  // of the tip from the spindle axis as it was measured, W1
};

struct Cell {
  std::string name;
  std::array<double, 3> program_zero_mm{};  // machine coordinates of the program's zero
  double least_mm{};                        // a smaller distance is a hit
  std::vector<CellSolid> solids;
  std::vector<CellTool> tools;
};

// Strict, as the other descriptions are. `file_name` is for messages.
Outcome<Cell> parseCell(std::string_view text, std::string_view file_name);

}  // namespace probebox::board
