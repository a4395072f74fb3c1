#include "firmware/metrology/live/rotary_correction.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <string>

namespace probebox::metrology {

Outcome<RotaryCorrection, Refusal> RotaryCorrection::of(std::span<const CalibratedAxis> links) {
  if (links.empty() || links.size() > kMostLinks) {
    return Refusal{"too-many-axes", std::to_string(links.size()) + " rotary axes: a chain has one to three"};
  }
  RotaryCorrection correction;
  correction.count_ = links.size();
  std::ranges::copy(links, correction.links_.begin());
  for (auto& link : correction.links_) link.direction.normalize();
  return correction;
}

std::optional<Eigen::Vector3d> RotaryCorrection::at(std::span<const std::optional<double>> angles,
                                                    const Eigen::Vector3d& point) const {
  if (angles.size() != count_ || !point.allFinite()) return std::nullopt;
  CarriedPoint carried{point};
  for (std::size_t k = count_; k-- > 0;) {
    if (!angles[k]) return std::nullopt;
    const AngleWithSine angle{*angles[k]};
    const auto errors = links_[k].errors.at(angle);
    if (!errors) return std::nullopt;
    carried.carry(links_[k].point, links_[k].direction, angle, *errors);
  }
  return carried.off();
}

std::optional<Eigen::Vector3d> RotaryCorrection::tablePoint(std::span<const std::optional<double>> angles,
                                                            const Eigen::Vector3d& machine_point) const {
  if (angles.size() != count_) return std::nullopt;
  Eigen::Vector3d point = machine_point;
  for (std::size_t k = 0; k < count_; ++k) {
    if (!angles[k]) return std::nullopt;
    const auto& link = links_[k];
    point = link.point + Eigen::AngleAxisd{-*angles[k], link.direction} * (point - link.point);
  }
  return point;
}

}  // namespace probebox::metrology
