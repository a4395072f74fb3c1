#include "firmware/metrology/live/rotary_chain.hpp"

#include <Eigen/Geometry>

namespace probebox::metrology {

Eigen::Vector3d chainError(std::span<const RotaryLink> links, const Eigen::Vector3d& point) {
  Eigen::Vector3d at = point;
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  for (auto link = links.rbegin(); link != links.rend(); ++link) {
    const Eigen::AngleAxisd turned{link->angle, link->direction.normalized()};
    at = link->point + turned * (at - link->point);
    off = turned * off + link->errors.head<3>() + link->errors.tail<3>().cross(at - link->point);
  }
  return off;
}

}  // namespace probebox::metrology
