#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tools/interference/scene.hpp"

namespace probebox::interference {

struct Hit {
  std::size_t line{};  // of the program
  Point tip{};         // machine coordinates
  Nearest nearest;
  double overlap_mm{};  // of a workpiece that is cut: how deep; 0 elsewhere
};

struct Report {
  std::size_t moves{};
  double length_mm{};          // of the path
  std::optional<Hit> nearest;  // the smallest distance of the whole path; nothing in an empty cell
  std::vector<Hit> hits;       // the first of each line and pair
  double removed_mm3{};        // of the workpieces
};

struct Settings {
  double step_mm{0.1};  // a hit that is deeper than this is never passed over
  double grid_mm{0.5};  // of the field of heights
};

// The cell without the workpieces that a program cuts: for the scene of a check.
board::Cell withoutStock(board::Cell cell);

// Moves the tool along the path, in the program's coordinates. A workpiece that is an upright box loses what the edges
// take away in feed; the rest of the tool, and all of it in rapid, must keep clear of what is left. All other solids
// must be kept clear of, by more than the cell's least distance. scene: of withoutStock(cell).
Report check(const board::Cell& cell, const board::CellTool& tool, const Scene& scene, std::span<const Move> path,
             const Settings& settings);

}  // namespace probebox::interference
