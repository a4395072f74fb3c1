#pragma once
#include <vector>

#include "board/describe/cell.hpp"
#include "tools/interference/program.hpp"

namespace probebox::interference {

// A workpiece that is a box, as a field of heights over a grid of X and Y: what a 3-axis program leaves of it.
class Stock {
 public:
  // Cells of `grid_mm`, or larger ones where the box would need more than a few million.
  Stock(const board::CellSolid& box, double grid_mm);

  double grid() const { return grid_; }
  // An upright cylinder from z upwards takes away what it covers.
  void cut(double x, double y, double z, double radius);
  // How far the material stands above the lower end of an upright cylinder, mm; 0 where it is free.
  double overlap(double x, double y, double z, double radius) const;
  double removed_mm3() const;

 private:
  template <class Use>
  void each(double x, double y, double radius, Use use) const;

  double grid_{};
  double x0_{}, y0_{}, bottom_{}, top_{};
  std::size_t columns_{}, rows_{};
  std::vector<float> heights_;  // above the bottom
};

}  // namespace probebox::interference
