#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "board/describe/cell.hpp"
#include "tools/interference/program.hpp"
#include "tools/interference/scene.hpp"

namespace probebox::interference {

// Heights above the bottom of a workpiece in square cells, row by row along Y, for a picture.
struct Heights {
  double cell_mm{};
  std::size_t columns{}, rows{};
  std::vector<float> mm;
};

// Material that a 3-axis program leaves of a box-shaped workpiece, as a height field over a grid of X and Y.
class Stock {
 public:
  // Uses cells of `grid_mm`, or larger ones where the box would need more than a few million.
  Stock(const board::CellSolid& box, double grid_mm);

  double grid() const { return grid_; }
  // Removes the material in an upright cylinder from z upwards.
  void cut(double x, double y, double z, double radius);
  // Height of the material above the lower end of an upright cylinder, mm; 0 if it is free.
  double overlap(double x, double y, double z, double radius) const;
  double removed_mm3() const;
  // Each cell of the picture has the height in its middle; of at most `most` cells.
  Heights picture(std::size_t most) const;

 private:
  template <class Use>
  void each(double x, double y, double radius, Use use) const;

  double grid_{};
  double x0_{}, y0_{}, bottom_{}, top_{};
  std::size_t columns_{}, rows_{};
  std::vector<float> heights_;  // above the bottom
};

struct Hit {
  std::size_t line{};    // of the program
  std::uint32_t tool{};  // number
  Pose pose;
  Nearest nearest;
  double overlap_mm{};  // depth in a workpiece that is cut; 0 for other solids
};

// What is left of a workpiece.
struct Left {
  std::string solid;
  Heights heights;
};

struct Report {
  std::size_t moves{};
  double length_mm{};          // of the path
  std::optional<Hit> nearest;  // smallest distance on the whole path; empty for an empty cell
  std::vector<Hit> hits;       // first hit of each line for each pair of tool part and solid
  double removed_mm3{};        // of the workpieces
  std::vector<Left> left;      // of the workpieces that the program could cut
};

struct Settings {
  double step_mm{0.1};              // hits deeper than this are never missed
  double grid_mm{0.5};              // cell size of the workpiece's height field
  std::function<bool()> stopped{};  // asked at every step; true ends the check, whose report is then of no use
};

// Returns the cell without the workpieces that the program cuts, for the scene of a check: upright boxes, where no
// rotary axis leaves 0.
board::Cell withoutStock(board::Cell cell, std::span<const Move> path);

// A tool of the cell, and where it is measured.
struct Mounted {
  board::CellTool tool;
  std::shared_ptr<const Scene> scene;  // of withoutStock(cell, path)
};

// Opens a scene for each tool that the path uses, `tools` being those of the cell. Error: as Scene::open.
Outcome<std::vector<Mounted>> mount(const board::Cell& cell, std::span<const board::CellTool> tools,
                                    std::span<const Move> path, const std::filesystem::path& folder);

// Moves the tools along the path, given in the program's coordinates: rapids on the straight line and on their dog-leg,
// probing moves until the cutter touches. In feed the cutting edges remove material from a
// workpiece that is an upright box; the rest of the tool, and in rapid all of it, must stay clear of the remaining
// material. The whole tool must stay clear of all other solids by more than the cell's least distance.
Report check(const board::Cell& cell, std::span<const Mounted> tools, std::span<const Move> path,
             const Settings& settings);

}  // namespace probebox::interference
