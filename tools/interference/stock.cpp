#include "tools/interference/stock.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::interference {
namespace {

constexpr double kMostCells = 4e6;

}  // namespace

Stock::Stock(const board::CellSolid& box, double grid_mm)
    : grid_{std::max(grid_mm, std::sqrt(box.size_mm[0] * box.size_mm[1] / kMostCells))},
      x0_{box.at_mm[0] - box.size_mm[0] / 2},
      y0_{box.at_mm[1] - box.size_mm[1] / 2},
      bottom_{box.at_mm[2] - box.size_mm[2] / 2},
      top_{box.at_mm[2] + box.size_mm[2] / 2},
      columns_{static_cast<std::size_t>(std::max(1.0, std::ceil(box.size_mm[0] / grid_)))},
      rows_{static_cast<std::size_t>(std::max(1.0, std::ceil(box.size_mm[1] / grid_)))},
      heights_(columns_ * rows_, static_cast<float>(top_ - bottom_)) {}

// The cells whose middle lies under the circle, and that under its middle, as a thin circle may miss all others.
template <class Use>
void Stock::each(double x, double y, double radius, Use use) const {
  const auto index = [&](double place, double origin, std::size_t most) {
    return static_cast<std::size_t>(std::clamp((place - origin) / grid_, 0.0, static_cast<double>(most)));
  };
  const double column = std::floor((x - x0_) / grid_), row = std::floor((y - y0_) / grid_);
  const bool over =
      column >= 0 && column < static_cast<double>(columns_) && row >= 0 && row < static_cast<double>(rows_);
  if (over) use(static_cast<std::size_t>(row) * columns_ + static_cast<std::size_t>(column));
  for (auto r = index(y - radius, y0_, rows_); r < rows_; ++r) {
    const double dy = y0_ + (static_cast<double>(r) + 0.5) * grid_ - y;
    if (dy > radius) break;
    const double half = radius * radius - dy * dy;
    if (half < 0) continue;
    const double reach = std::sqrt(half);
    for (auto c = index(x - reach, x0_, columns_); c < columns_; ++c) {
      const double dx = x0_ + (static_cast<double>(c) + 0.5) * grid_ - x;
      if (dx > reach) break;
      if (dx >= -reach) use(r * columns_ + c);
    }
  }
}

void Stock::cut(double x, double y, double z, double radius) {
  const auto left = static_cast<float>(std::max(0.0, z - bottom_));
  each(x, y, radius, [&](std::size_t cell) { heights_[cell] = std::min(heights_[cell], left); });
}

double Stock::overlap(double x, double y, double z, double radius) const {
  double most = 0;
  if (z >= top_) return most;
  each(x, y, radius, [&](std::size_t cell) {
    if (heights_[cell] > 0) most = std::max(most, bottom_ + double{heights_[cell]} - z);
  });
  return most;
}

double Stock::removed_mm3() const {
  double all = 0;
  for (const float height : heights_) all += top_ - bottom_ - double{height};
  return all * grid_ * grid_;
}

Heights Stock::picture(std::size_t most) const {
  const double shrink = std::sqrt(static_cast<double>(columns_ * rows_) / static_cast<double>(most));
  const auto every = static_cast<std::size_t>(std::max(1.0, std::ceil(shrink)));
  Heights made{grid_ * static_cast<double>(every), (columns_ + every - 1) / every, (rows_ + every - 1) / every, {}};
  made.mm.reserve(made.columns * made.rows);
  for (std::size_t r = 0; r < made.rows; ++r) {
    for (std::size_t c = 0; c < made.columns; ++c) {
      const auto row = std::min(rows_ - 1, r * every + every / 2),
                 column = std::min(columns_ - 1, c * every + every / 2);
      made.mm.push_back(heights_[row * columns_ + column]);
    }
  }
  return made;
}

}  // namespace probebox::interference
