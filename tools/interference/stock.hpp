#pragma once
#include <cstddef>
#include <vector>

#include "board/describe/cell.hpp"
#include "tools/interference/program.hpp"

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

}  // namespace probebox::interference
