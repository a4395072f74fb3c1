#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch_noise.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One touch as one point (CN101622513, docs/metrology.md (A2)): M = P - T v.
struct SurfacePoint {
  std::string name;
  Eigen::Vector3d normal;   // of the surface, outward
  Eigen::Vector3d machine;  // M, mm: of the probe relative to the workpiece
  Eigen::Vector3d apex;     // the same at rest on the surface
  Eigen::Vector3d probe_velocity;
  Eigen::Vector3d article_velocity;  // zero when only the probe moves
  double depth_mm{};                 // overtravel by the gain of the touch
  double lever_s{};                  // from the middle of the machine's window to the point
  double of_mean{};   // variance, mm^2: along the motion of the machine's line at its middle, and of the probe
  double of_slope{};  // (mm/s)^2
  double of_both{};   // covariance of that line's middle and slope, mm^2/s; not zero if the workpiece moves
  double across{};    // mm^2, across the motion
};

struct SurfacePoints {
  std::vector<SurfacePoint> points;
  std::vector<Dropped> dropped;
  std::vector<std::string> warnings;
  std::size_t dof{};        // of the residuals behind the variances
  std::size_t least_dof{};  // of those of the stream with fewer
};

// The point is at zero deflection (A6), (A7) or, with a threshold, where |A d| falls through it. A table "article"
// holds the workpiece's own position on its own stamps: points are then relative to it.
struct PointQuestion {
  std::optional<double> threshold_mm{};
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};  // A, for the threshold
  std::size_t unknowns{};                             // to be determined from the points
};

// Drops bad touches by name as long as more than half remain, and one more than the unknowns. Refuses what readTouches
// and fitRetract refuse; bad-threshold (under five sd of a sample, or above 0.8 of the deflection).
Outcome<SurfacePoints, Refusal> surfacePoints(const Dataset& dataset, const PointQuestion& question);

}  // namespace probebox::metrology
