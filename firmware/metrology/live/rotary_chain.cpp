#include "firmware/metrology/live/rotary_chain.hpp"

namespace probebox::metrology {

Eigen::Vector3d chainError(std::span<const RotaryLink> links, const Eigen::Vector3d& point) {
  CarriedPoint carried{point};
  for (auto link = links.rbegin(); link != links.rend(); ++link)
    carried.carry(link->point, link->direction, link->angle, link->errors);
  return carried.off();
}

}  // namespace probebox::metrology
