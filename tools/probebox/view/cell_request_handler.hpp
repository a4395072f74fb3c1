#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "board/describe/cell.hpp"
#include "tools/interference/scene.hpp"
#include "tools/probebox/view/box_connection.hpp"

namespace probebox::view {

// Lengths from a result and from the store of the box, which replace those in cell.toml.
struct Measured {
  double assembled_mm{};              // L3
  std::array<double, 2> w1_mm{};      // W1
  std::optional<double> holder_mm{};  // L1
};

// Answers the requests of the page about a cell: its scene, distances and interference checks.
class CellRequestHandler {
 public:
  // path: of cell.toml; empty for no cell. stopped: ends a check. Error: why it cannot be read.
  static Outcome<CellRequestHandler> open(const std::string& path, std::function<bool()> stopped);

  // Solids, with the triangles of meshes, and tools with their stored and measured lengths. Null without a cell.
  std::string scene() const;
  // The smallest distance of a tool.
  BoxConnection::Answer nearest(std::uint32_t tool, const std::optional<Measured>& measured,
                                const interference::Pose& pose) const;
  // body: {"tool", "program", "measured": {"assembled_mm", "W1_mm", "holder_mm"}, "stored"}. Returns the hits, the
  // smallest distance, and the path to draw.
  BoxConnection::Answer check(const std::string& body) const;

 private:
  std::optional<board::Cell> cell_;
  std::filesystem::path folder_;
  std::function<bool()> stopped_;
};

}  // namespace probebox::view
