#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "board/describe/cell.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/interference/program.hpp"

namespace probebox::interference {

// The lengths by which a tool is drawn and moved (CN103801980): measured ones in place of those in store.
struct Lengths {
  double holder_mm{};     // L1
  double assembled_mm{};  // from the holder's face to the tip: L3, or the stored one where none was measured
  std::array<double, 2> offset_mm{};  // of the tip from the spindle axis: W1
  bool measured{};
};
Lengths lengthsOf(const board::CellTool& tool);

enum class ToolPart : std::uint8_t { cutter, shank, holder };
std::string_view nameOf(ToolPart part);

// The smallest distance between a part of the tool and a solid. Zero where they touch or overlap.
struct Nearest {
  double distance_mm{};
  std::string solid;
  ToolPart part{};
  Point on_tool{}, on_solid{};  // machine coordinates; where they overlap a point of the overlap
};

// Triangles of an STL file, binary or text, mm.
struct Mesh {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};
Outcome<Mesh> readStl(const std::filesystem::path& path);

// The solids of a cell and one tool, measured against each other by FCL. The tool is upright.
class Scene {
 public:
  // folder: where the files of meshes are. Error: a mesh that cannot be read.
  static Outcome<std::unique_ptr<Scene>> open(const board::Cell& cell, const board::CellTool& tool,
                                              const std::filesystem::path& folder);
  ~Scene();

  // tip: machine coordinates of the tip without its offset. cuts: the edges may touch the workpiece.
  // Nothing in the cell: an infinite distance.
  Nearest nearest(const Point& tip, bool cuts) const;
  const Lengths& lengths() const { return lengths_; }

 private:
  Scene();
  struct Objects;
  std::unique_ptr<Objects> objects_;
  Lengths lengths_;
};

}  // namespace probebox::interference
