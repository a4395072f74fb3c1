#include "tools/interference/check.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace probebox::interference {
namespace {

constexpr std::size_t kMostPictured = 40'000;  // cells of a picture

Point between(const Point& from, const Point& to, double part) {
  Point at{};
  for (std::size_t k = 0; k < at.size(); ++k) at[k] = from[k] + part * (to[k] - from[k]);
  return at;
}

double distance(const Point& from, const Point& to) {
  return std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
}

bool turns(std::span<const Move> path) {
  return std::ranges::any_of(path,
                             [](const Move& move) { return move.from_deg != Angles{} || move.to_deg != Angles{}; });
}

bool isUpright(const board::CellSolid& solid) {
  return solid.part == board::SolidPart::workpiece && solid.shape == board::SolidShape::box &&
         solid.turn_deg == std::array<double, 3>{};
}

class Walk {
 public:
  Walk(const board::Cell& cell, const board::CellTool& tool, const Scene& scene, const Settings& settings, bool cuts)
      : cell_{cell}, tool_{tool}, scene_{scene}, settings_{settings} {
    for (const auto& solid : cell.solids) {
      if (cuts && isUpright(solid)) stocks_.emplace_back(solid.name, Stock{solid, settings.grid_mm});
    }
  }

  void along(const Move& move) {
    const double length = distance(move.from, move.to);
    ++report_.moves;
    report_.length_mm += length;
    solids(move, scene_.travel(move));
    for (auto& [name, stock] : stocks_) {
      const auto steps = static_cast<std::size_t>(std::ceil(length / (stock.grid() / 2)));
      for (std::size_t k = 0; k <= steps && !stopped(); ++k)
        workpiece(move, steps == 0 ? 0 : static_cast<double>(k) / static_cast<double>(steps), name, stock);
    }
  }

  bool stopped() const { return settings_.stopped && settings_.stopped(); }

  Report finish() {
    for (const auto& [name, stock] : stocks_) {
      report_.removed_mm3 += stock.removed_mm3();
      report_.left.push_back({name, stock.picture(kMostPictured)});
    }
    return std::move(report_);
  }

 private:
  Pose poseAt(const Move& move, double part) const {
    Pose pose{between(move.from, move.to, part), between(move.from_deg, move.to_deg, part)};
    for (std::size_t k = 0; k < pose.tip.size(); ++k) pose.tip[k] += cell_.program_zero_mm[k];
    return pose;
  }

  // No point comes nearer than the move travels at most: from a place with distance d the next d can be passed over,
  // but for the part in which a new smallest distance might lie.
  void solids(const Move& move, double travel) {
    for (double passed = 0; !stopped();) {
      const auto pose = poseAt(move, travel > 0 ? passed / travel : 0);
      const auto nearest = scene_.nearest(pose, !move.rapid);
      if (nearest.solid.empty()) return;
      if (!report_.nearest || nearest.distance_mm < report_.nearest->nearest.distance_mm)
        report_.nearest = Hit{move.line, pose, nearest, 0};
      const bool hit = nearest.distance_mm == 0 || nearest.distance_mm < cell_.least_mm;
      if (hit) note({move.line, pose, nearest, 0});
      if (passed >= travel) return;
      const double least =
          std::min(std::max(report_.nearest->nearest.distance_mm, cell_.least_mm), nearest.distance_mm);
      passed = std::min(travel, passed + std::max(settings_.step_mm, nearest.distance_mm - least));
    }
  }

  void workpiece(const Move& move, double part, const std::string& name, Stock& stock) {
    const auto pose = poseAt(move, part);
    const auto& tip = pose.tip;
    const auto& lengths = scene_.lengths();
    const double x = tip[0] + lengths.tip_mm[0], y = tip[1] + lengths.tip_mm[1];
    // Before the edges cut: above them is what they leave.
    against(move, pose, stock.overlap(x, y, tip[2] + tool_.cutting_mm, tool_.radius_mm), ToolPart::shank, name);
    against(move, pose, stock.overlap(x, y, tip[2] + lengths.assembled_mm, tool_.holder_radius_mm), ToolPart::holder,
            name);
    if (move.rapid) {
      against(move, pose, stock.overlap(x, y, tip[2], tool_.radius_mm), ToolPart::cutter, name);
    } else {
      stock.cut(x, y, tip[2], tool_.radius_mm);
    }
  }

  void against(const Move& move, const Pose& pose, double overlap, ToolPart part, const std::string& name) {
    constexpr double kTouching_mm = 1e-4;  // heights are floats
    if (overlap > kTouching_mm) note({move.line, pose, {0, name, part, pose.tip, pose.tip}, overlap});
  }

  void note(const Hit& hit) {
    if (!noted_.emplace(hit.line, hit.nearest.solid, hit.nearest.part).second) return;
    report_.hits.push_back(hit);
    if (!report_.nearest || hit.nearest.distance_mm < report_.nearest->nearest.distance_mm) report_.nearest = hit;
  }

  const board::Cell& cell_;
  const board::CellTool& tool_;
  const Scene& scene_;
  Settings settings_;
  std::vector<std::pair<std::string, Stock>> stocks_;
  std::set<std::tuple<std::size_t, std::string, ToolPart>> noted_;
  Report report_;
};

}  // namespace

Report check(const board::Cell& cell, const board::CellTool& tool, const Scene& scene, std::span<const Move> path,
             const Settings& settings) {
  Walk walk{cell, tool, scene, settings, !turns(path)};
  for (const auto& move : path) {
    if (walk.stopped()) break;
    walk.along(move);
  }
  return walk.finish();
}

board::Cell withoutStock(board::Cell cell, std::span<const Move> path) {
  if (turns(path)) return cell;
  std::erase_if(cell.solids, isUpright);
  return cell;
}

}  // namespace probebox::interference
