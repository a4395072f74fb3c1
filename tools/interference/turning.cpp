#include "tools/interference/turning.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::interference {

Turning::Turning(const std::vector<board::CellRotary>& axes, double gauge_mm) {
  for (const auto& axis : axes) {
    const bool head = axis.carries == board::Carries::tool;
    axes_.push_back({static_cast<std::size_t>(axis.letter), axis.carries, Eigen::Vector3d{axis.direction.data()},
                     Eigen::Vector3d{axis.through_mm.data()} + (head ? gauge_mm : 0.0) * Eigen::Vector3d::UnitZ()});
  }
}

// Places of the axes of one chain, from the base to `last`.
std::vector<std::size_t> Turning::chain(board::Carries carries, std::size_t last) const {
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < axes_.size() && k <= last; ++k) {
    if (axes_[k].carries == carries) all.push_back(k);
  }
  return all;
}

Eigen::Isometry3d Turning::along(std::span<const std::size_t> chain, const Angles& angles_deg) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const auto place : chain) {
    const auto& axis = axes_[place];
    pose.translate(axis.through);
    pose.rotate(Eigen::AngleAxisd{angles_deg[axis.letter] * kDegree, axis.direction});
    pose.translate(-axis.through);
  }
  return pose;
}

Eigen::Isometry3d Turning::ofSolids(std::size_t place, const Angles& angles_deg) const {
  return along(chain(board::Carries::solids, place), angles_deg);
}

Eigen::Isometry3d Turning::ofTool(const Angles& angles_deg) const {
  return along(chain(board::Carries::tool, axes_.size()), angles_deg);
}

void Turning::carry(std::size_t place, const Around& around) {
  lengthen(chain(board::Carries::solids, place), around);
}

void Turning::carryTool(const Around& around) {
  lengthen(chain(board::Carries::tool, axes_.size()), around);
}

// The outermost axis keeps the ball at one distance from itself, and the points of its axis at one distance from the
// axis that carries it: the sum of these is the longest arm, however the axes in between stand.
void Turning::lengthen(std::span<const std::size_t> chain, const Around& around) {
  double beyond = 0;
  for (std::size_t k = chain.size(); k-- > 0;) {
    auto& axis = axes_[chain[k]];
    const bool outermost = k + 1 == chain.size();
    const double from_line = (around.middle - axis.through).cross(axis.direction).norm();
    axis.arm_mm = std::max(axis.arm_mm, outermost ? from_line + around.radius_mm : beyond);
    beyond += outermost ? (around.middle - axis.through).norm() + around.radius_mm : 0;
    if (k > 0) beyond += (axis.through - axes_[chain[k - 1]].through).norm();
  }
}

double Turning::highest(std::size_t place, const Around& around) const {
  const auto axes = chain(board::Carries::solids, place);
  double reach = around.radius_mm;
  Eigen::Vector3d at = around.middle;
  for (auto k = axes.rbegin(); k != axes.rend(); ++k) {
    reach += (at - axes_[*k].through).norm();
    at = axes_[*k].through;
  }
  return at[2] + reach;
}

double Turning::far(const Angles& from_deg, const Angles& to_deg) const {
  double all = 0;
  for (const auto& axis : axes_) all += std::abs(to_deg[axis.letter] - from_deg[axis.letter]) * kDegree * axis.arm_mm;
  return all;
}

}  // namespace probebox::interference
