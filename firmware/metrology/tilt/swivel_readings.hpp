#pragma once
#include <Eigen/Core>
#include <vector>

// Readings of a ball by tools on a swivelling head (docs/metrology.md B.8).
namespace probebox::metrology {

struct SwivelReading {
  double swivel_deg{};
  double length_mm{};
  Eigen::Vector3d at;
};

// Mean of two touches with the shank, with the spindle turned by 180 degrees between them (B16). It is used only along
// `side`, a unit vector from the ball, and is further out by the radii of ball and shank.
struct ShankTouch {
  SwivelReading reading;
  Eigen::Vector3d side;
};

struct SwivelReadings {
  std::vector<SwivelReading> tips;
  std::vector<ShankTouch> shank;  // of one tool with the tip, which is then the only one
  // sd of a touch with the shank, and of a tip's coordinate along the axis, in units of the sd of a tip's coordinate
  // across the swivel axis.
  double shank_spread{1.0};
  double along_spread{1.0};
  double stop_sd_rad{0.0};                            // of a stop of B (k = 1); 0: readings alone are off
  Eigen::Vector3d pivot_mm{Eigen::Vector3d::Zero()};  // from the gauge line to the swivel axis, head level

  bool byShank() const { return !shank.empty(); }
};

}  // namespace probebox::metrology
