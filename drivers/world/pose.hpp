#pragma once
#include <algorithm>
#include <cmath>

#include "drivers/world/solids.hpp"

namespace probebox::world {

// Angles of the rotary axes: the probe's spindle, the head that holds it, the table under the part, the part's spindle.
struct Pose {
  double a_rad{};
  double head_rad{};
  double table_rad{};
  double c_rad{};

  PartPose part() const { return {c_rad, table_rad}; }
  friend bool operator==(const Pose&, const Pose&) = default;
};

// The longest of the turns from one pose to another.
inline double wayBetween(const Pose& from, const Pose& to) {
  return std::max({std::abs(to.a_rad - from.a_rad), std::abs(to.head_rad - from.head_rad),
                   std::abs(to.table_rad - from.table_rad), std::abs(to.c_rad - from.c_rad)});
}

inline Pose between(const Pose& from, const Pose& to, double share) {
  const auto at = [share](double one, double other) { return one + share * (other - one); };
  return {at(from.a_rad, to.a_rad), at(from.head_rad, to.head_rad), at(from.table_rad, to.table_rad),
          at(from.c_rad, to.c_rad)};
}

}  // namespace probebox::world
