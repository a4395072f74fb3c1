#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "board/describe/cell.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/interference/program.hpp"

namespace probebox::interference {

// Lengths of a tool for drawing and moving it (CN103801980): measured ones where they exist, else stored ones.
struct Lengths {
  double holder_mm{};              // L1
  double assembled_mm{};           // from the holder's face to the tip: measured (L3), else stored
  std::array<double, 2> tip_mm{};  // of the tip from the spindle axis: -W1, as W1 is the axis from the tip (C3)
  bool measured{};
};
Lengths lengthsOf(const board::CellTool& tool);

enum class ToolPart : std::uint8_t { cutter, shank, holder };
std::string_view nameOf(ToolPart part);

// Smallest distance between a part of the tool and a solid; zero if they touch or overlap.
struct Nearest {
  double distance_mm{};
  std::string solid;
  ToolPart part{};
  Point on_tool{}, on_solid{};  // machine coordinates; a point of the overlap if they overlap
};

// Triangles of an STL file, binary or text, mm.
struct Mesh {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};
Outcome<Mesh> readStl(const std::filesystem::path& path);

// Measures distances between one upright tool and the solids of a cell with FCL.
class Scene {
 public:
  // folder: contains the mesh files. Error: a mesh that cannot be read.
  static Outcome<std::unique_ptr<Scene>> open(const board::Cell& cell, const board::CellTool& tool,
                                              const std::filesystem::path& folder);
  ~Scene();

  // tip: machine coordinates of the tip if it were on the spindle axis. cuts: the edges may touch the workpiece.
  // Returns an infinite distance for an empty cell.
  Nearest nearest(const Point& tip, bool cuts) const;
  const Lengths& lengths() const { return lengths_; }

 private:
  Scene();
  struct Objects;
  std::unique_ptr<Objects> objects_;
  Lengths lengths_;
};

}  // namespace probebox::interference
