#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "board/describe/cell.hpp"
#include "tools/probebox/view/desk.hpp"

namespace probebox::view {

// Lengths that the page has from a result of the box, in place of those in cell.toml.
struct Measured {
  double assembled_mm{};              // L3
  std::array<double, 2> offset_mm{};  // W1
};

// What a page draws of a cell, and what it asks of it.
class CellDesk {
 public:
  // path: of cell.toml; empty for no cell. Error: why it cannot be read.
  static Outcome<CellDesk> open(const std::string& path);

  // Solids, with the triangles of meshes, and tools with their lengths in store and as measured. Null without a cell.
  std::string scene() const;
  // The smallest distance of a tool whose tip is at a machine position.
  Desk::Answer nearest(std::uint32_t tool, const std::optional<Measured>& measured,
                       const std::array<double, 3>& tip_mm) const;
  // {"tool", "program", "measured": {"assembled_mm", "offset_mm"}, "stored"}: hits, smallest distance, and the path for
  // the picture.
  Desk::Answer check(const std::string& body) const;

 private:
  std::optional<board::Cell> cell_;
  std::filesystem::path folder_;
};

}  // namespace probebox::view
