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

// What a program for this cell may contain.
Dialect dialectOf(const board::Cell& cell, std::uint32_t tool);

enum class ToolPart : std::uint8_t { cutter, shank, holder };
std::string_view nameOf(ToolPart part);

// Smallest distance between a part of the tool and a solid; zero if they touch or overlap.
struct Nearest {
  double distance_mm{};
  std::string solid;
  ToolPart part{};
  Point on_tool{}, on_solid{};  // machine coordinates; a point of the overlap if they overlap
};

// Triangles of an STL file, binary or text.
struct Mesh {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};
// In the file's unit, which it does not state.
Outcome<Mesh> readStl(const std::filesystem::path& path);
// A solid whose shape is a mesh, in mm. Error: also a surface that is not closed, and a size that makes the unit
// doubtful where the cell does not state it.
Outcome<Mesh> meshOf(const board::CellSolid& solid, const std::filesystem::path& folder);

Point sizeOf(const Mesh& mesh);

// Tells the inside of a mesh from its outside.
class Inside {
 public:
  explicit Inside(const Mesh& mesh);
  // Whether a place, not on a surface, is in the material. Surfaces may enclose one another: one that is turned inside
  // out is the wall of a cavity.
  bool contains(const Point& at) const;

 private:
  std::size_t rowOf(double y) const;

  std::vector<std::array<Point, 3>> triangles_;
  std::vector<std::size_t> surface_;              // of each triangle
  std::vector<double> volumes_;                   // of each surface; negative where it is turned inside out
  double front_{}, row_{};                        // the least Y, and the width of a row
  std::vector<std::vector<std::uint32_t>> rows_;  // triangles that reach into each
};

// A mesh of a scene, for the user to see that its unit is right.
struct MeshSize {
  std::string solid;
  Point size_mm{};
  bool unit_stated{};
};

// Where a tool stands.
struct Pose {
  Point tip{};  // machine coordinates of the tip if it were on the spindle axis and all axes of the head at 0
  Angles angles_deg{};
};

// Measures distances between one tool and the solids of a cell with FCL.
class Scene {
 public:
  // folder: contains the mesh files. Error: a mesh that cannot be read.
  static Outcome<std::shared_ptr<const Scene>> open(const board::Cell& cell, const board::CellTool& tool,
                                                    const std::filesystem::path& folder);
  ~Scene();
  // The same solids for another tool.
  std::shared_ptr<const Scene> with(const board::CellTool& tool) const;

  // cuts: the edges may touch the workpiece. Returns an infinite distance for an empty cell.
  Nearest nearest(const Pose& pose, bool cuts) const;
  // An upper bound for what any point of the tool moves by against any point of a solid, mm.
  double travel(const Move& move) const;
  const Lengths& lengths() const { return lengths_; }
  // An upper bound for the height of all solids, however the axes stand, machine coordinates.
  double top() const;
  const std::vector<MeshSize>& meshes() const { return meshes_; }

 private:
  Scene();
  struct Objects;
  std::unique_ptr<Objects> objects_;
  Lengths lengths_;
  std::vector<board::CellRotary> rotary_;
  std::vector<MeshSize> meshes_;
};

}  // namespace probebox::interference
