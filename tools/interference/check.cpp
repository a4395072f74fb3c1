#include "tools/interference/check.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace probebox::interference {
namespace {

constexpr double kMostCells = 4e6;

constexpr std::size_t kMostPictured = 40'000;  // cells of a picture
constexpr double kTouching_mm = 1e-4;          // heights are floats
constexpr double kFinest_mm = 0.1;             // cells of a workpiece
constexpr double kClear_mm = 1;                // above everything

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
  Walk(const board::Cell& cell, std::span<const Mounted> tools, const Settings& settings, bool cuts)
      : cell_{cell}, tools_{tools}, settings_{settings} {
    for (const auto& solid : cell.solids) {
      if (!cuts || !isUpright(solid)) continue;
      stocks_.emplace_back(solid.name, Stock{solid, gridFor(tools, settings.grid_mm)});
      above_mm_ = std::max(above_mm_, solid.at_mm[2] + solid.size_mm[2] / 2);
    }
    for (const auto& mounted : tools) above_mm_ = std::max(above_mm_, mounted.scene->top());
    above_mm_ += kClear_mm - cell.program_zero_mm[2];
  }

  void along(const Move& programmed) {
    const auto move = asMade(programmed);
    const auto found = std::ranges::find(tools_, move.tool, [](const Mounted& one) { return one.tool.number; });
    mounted_ = &*found;
    ++report_.moves;
    report_.length_mm += lengthOf(move);
    if (move.way == Way::probe) {
      probe(move);
      return;
    }
    sweep(move, 1);
    if (move.way != Way::rapid) return;
    for (const auto& leg : dogLeg(move)) sweep(leg, 1);
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
  // What a thin tool removes needs fine cells.
  static double gridFor(std::span<const Mounted> tools, double grid_mm) {
    for (const auto& mounted : tools) grid_mm = std::min(grid_mm, std::max(mounted.tool.radius_mm, kFinest_mm));
    return grid_mm;
  }

  // From where a probing move ended, and with a height for what is above everything.
  Move asMade(Move move) {
    // The arc would not be that of the program: the probing move before it was to touch nothing.
    if (move.turn_rad != 0 && touch_ && carry_ != Point{}) {
      note(*touch_);
      carry_ = {};
    }
    for (std::size_t k = 0; k < carry_.size(); ++k) {
      move.from[k] += carry_[k];
      if (move.absolute[k]) carry_[k] = 0;
      move.to[k] += carry_[k];
    }
    const double from_z = move.from[2], to_z = move.to[2];
    if (from_z == kAbove_mm) move.from[2] = std::max(above_mm_, to_z);
    if (to_z == kAbove_mm) move.to[2] = std::max(above_mm_, from_z);
    return move;
  }

  Pose poseAt(const Move& move, double part) const {
    Pose pose{placeOn(move, part), {}};
    for (std::size_t k = 0; k < pose.tip.size(); ++k) {
      pose.tip[k] += cell_.program_zero_mm[k];
      pose.angles_deg[k] = move.from_deg[k] + part * (move.to_deg[k] - move.from_deg[k]);
    }
    return pose;
  }

  // Returns the part of the way up to where the cutter of a probing move touches; else `until`.
  double sweep(const Move& move, double until) {
    for (auto& [name, stock] : stocks_) {
      const auto steps = static_cast<std::size_t>(std::ceil(until * lengthOf(move) / (stock.grid() / 2)));
      double before = 0;
      for (std::size_t k = 0; k <= steps && !stopped(); ++k) {
        const double part = steps == 0 ? 0 : until * static_cast<double>(k) / static_cast<double>(steps);
        if (touchesWorkpiece(move, part, name, stock)) {
          until = before;
          break;
        }
        before = part;
      }
    }
    return solids(move, until);
  }

  void probe(const Move& move) {
    touch_.reset();
    const auto end = placeOn(move, sweep(move, 1));
    touching_ = touch_.has_value();
    for (std::size_t k = 0; k < carry_.size(); ++k) carry_[k] += end[k] - move.to[k];
  }

  // No point comes nearer than the move travels at most: from a place with distance d the next d can be passed over,
  // but for the part in which a new smallest distance might lie.
  double solids(const Move& move, double until) {
    const double travel = mounted_->scene->travel(move), last = until * travel;
    double clear = 0;
    for (double passed = 0; !stopped();) {
      const auto pose = poseAt(move, travel > 0 ? passed / travel : 0);
      const auto nearest = mounted_->scene->nearest(pose, move.way == Way::feed);
      if (nearest.solid.empty()) return until;
      const bool sought = move.way == Way::probe && nearest.part == ToolPart::cutter;
      if (sought && nearest.distance_mm == 0) {
        touch_ = Hit{move.line, move.tool, pose, nearest, 0};
        return travel > 0 ? touch(move, clear, passed) / travel : 0;
      }
      if (!report_.nearest || nearest.distance_mm < report_.nearest->nearest.distance_mm)
        report_.nearest = Hit{move.line, move.tool, pose, nearest, 0};
      if (!sought) judge({move.line, move.tool, pose, nearest, 0});
      if (passed >= last) return until;
      clear = passed;
      const double least =
          std::min(std::max(report_.nearest->nearest.distance_mm, cell_.least_mm), nearest.distance_mm);
      passed = std::min(last, passed + std::max(settings_.step_mm, nearest.distance_mm - least));
    }
    return until;
  }

  // Returns how far a probing move goes until it touches, less the last of its steps.
  double touch(const Move& move, double clear, double touched) const {
    constexpr double kFine_mm = 1e-4;
    const double travel = mounted_->scene->travel(move);
    while (touched - clear > kFine_mm) {
      const double middle = (clear + touched) / 2;
      const bool free = mounted_->scene->nearest(poseAt(move, middle / travel), false).distance_mm > 0;
      (free ? clear : touched) = middle;
    }
    return clear;
  }

  // The cutter that has just touched a solid in a probing move stays beside it until it is away.
  void judge(const Hit& hit) {
    const auto& nearest = hit.nearest;
    const bool near = nearest.distance_mm == 0 || nearest.distance_mm < cell_.least_mm;
    const bool beside = touching_ && nearest.solid == touch_->nearest.solid && nearest.part == ToolPart::cutter;
    const bool excused = beside && nearest.distance_mm > 0;
    if (near && !excused) note(hit);
    touching_ = touching_ && near;
  }

  // Whether the cutter of a probing move touches a workpiece.
  bool touchesWorkpiece(const Move& move, double part, const std::string& name, Stock& stock) {
    const auto pose = poseAt(move, part);
    const auto& tip = pose.tip;
    const auto& tool = mounted_->tool;
    const auto& lengths = mounted_->scene->lengths();
    const double x = tip[0] + lengths.tip_mm[0], y = tip[1] + lengths.tip_mm[1];
    // Before the edges cut: above them is what they leave.
    const double shank = stock.overlap(x, y, tip[2] + tool.cutting_mm, tool.radius_mm);
    const double holder = stock.overlap(x, y, tip[2] + lengths.assembled_mm, tool.holder_radius_mm);
    against(move, pose, shank, ToolPart::shank, name);
    against(move, pose, holder, ToolPart::holder, name);
    if (move.way == Way::feed) {
      stock.cut(x, y, tip[2], tool.radius_mm);
      return false;
    }
    const double cutter = stock.overlap(x, y, tip[2], tool.radius_mm);
    if (move.way == Way::probe) {
      if (cutter > kTouching_mm)
        touch_ = Hit{move.line, move.tool, pose, {0, name, ToolPart::cutter, pose.tip, pose.tip}, cutter};
      return cutter > kTouching_mm;
    }
    against(move, pose, cutter, ToolPart::cutter, name);
    return false;
  }

  void against(const Move& move, const Pose& pose, double overlap, ToolPart part, const std::string& name) {
    if (overlap > kTouching_mm) note({move.line, move.tool, pose, {0, name, part, pose.tip, pose.tip}, overlap});
  }

  void note(const Hit& hit) {
    if (!noted_.emplace(hit.line, hit.nearest.solid, hit.nearest.part).second) return;
    report_.hits.push_back(hit);
    if (!report_.nearest || hit.nearest.distance_mm < report_.nearest->nearest.distance_mm) report_.nearest = hit;
  }

  const board::Cell& cell_;
  std::span<const Mounted> tools_;
  const Mounted* mounted_{};
  Settings settings_;
  std::vector<std::pair<std::string, Stock>> stocks_;
  std::set<std::tuple<std::size_t, std::string, ToolPart>> noted_;
  double above_mm_{-kAbove_mm};  // height of the tip above everything, in the program's coordinates
  Point carry_{};                // from where the path has the tip to where it is, since a probing move
  std::optional<Hit> touch_;     // of the last probing move
  bool touching_{};              // since then
  Report report_;
};

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

Report check(const board::Cell& cell, std::span<const Mounted> tools, std::span<const Move> path,
             const Settings& settings) {
  Walk walk{cell, tools, settings, !turns(path)};
  for (const auto& move : path) {
    if (walk.stopped()) break;
    walk.along(move);
  }
  return walk.finish();
}

Outcome<std::vector<Mounted>> mount(const board::Cell& cell, std::span<const board::CellTool> tools,
                                    std::span<const Move> path, const std::filesystem::path& folder) {
  std::set<std::uint32_t> used;
  for (const auto& move : path) used.insert(move.tool);
  const auto rest = withoutStock(cell, path);
  std::vector<Mounted> mounted;
  for (const auto& tool : tools) {
    if (!used.contains(tool.number)) continue;
    if (mounted.empty()) {
      TRY(auto scene, Scene::open(rest, tool, folder));
      mounted.push_back({tool, std::move(scene)});
    } else {
      mounted.push_back({tool, mounted.front().scene->with(tool)});
    }
  }
  return mounted;
}

board::Cell withoutStock(board::Cell cell, std::span<const Move> path) {
  if (turns(path)) return cell;
  std::erase_if(cell.solids, isUpright);
  return cell;
}

}  // namespace probebox::interference
