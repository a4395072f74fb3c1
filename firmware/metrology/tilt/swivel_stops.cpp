#include "firmware/metrology/tilt/swivel_stops.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <map>

#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

bool ofOneStop(const SwivelReading& a, const SwivelReading& b) {
  return a.length_mm == b.length_mm && std::abs(std::remainder(a.swivel_deg - b.swivel_deg, 360.0)) <= kSameStop_deg;
}

// Displacement of the reported ball by one sd of the stop.
Vector3d movedByStop(const SwivelReading& reading, const SwivelReadings& all, const SwivelPlane& plane) {
  const Vector3d axis = plane.sense * Vector3d::Unit(plane.axis);
  const Vector3d arm = Vector3d{0, 0, -reading.length_mm} - all.pivot_mm;
  return -all.stop_sd_rad * axis.cross(Eigen::AngleAxisd{reading.swivel_deg * kDegree, axis} * arm);
}

}  // namespace

Outcome<std::vector<std::string>, Refusal> takeStops(SwivelReadings& readings, const Dataset& dataset,
                                                     const Sigma& sigma) {
  TRY(const auto stop, configSigma(dataset, "sigma_angle_rad"));
  TRY(const auto pivot, configVector(dataset, "pivot_mm"));
  if (!stop.stated) return std::vector<std::string>{};
  if (!pivot) {
    return Refusal{"missing-key",
                   "config key 'sigma_angle_rad' is stated without pivot_mm, from which the arm of each tool follows: "
                   "give the vector from the gauge line to the swivel axis with the head level and tools towards -Z"};
  }
  if (!sigma.stated) return std::vector<std::string>{"sigma_angle_rad is not used: it also needs sigma_mm"};
  readings.stop_sd_rad = stop.value;
  readings.pivot_mm = Vector3d{pivot->data()};
  return std::vector<std::string>{};
}

std::vector<double> stopOfEachRow(const SwivelReadings& readings) {
  std::vector<double> stops;
  double stop = 0;
  for (std::size_t k = 0; k < readings.tips.size(); ++k) {
    if (k > 0 && !ofOneStop(readings.tips[k - 1], readings.tips[k])) ++stop;
    stops.insert(stops.end(), 3, stop);
  }
  for (std::size_t k = 0; k < readings.shank.size(); ++k) {
    if (k == 0 || !ofOneStop(readings.shank[k - 1].reading, readings.shank[k].reading)) ++stop;
    stops.push_back(stop);
  }
  return stops;
}

VectorXd movedByStops(const SwivelReadings& readings, const SwivelPlane& plane) {
  const auto tips = static_cast<Index>(3 * readings.tips.size());
  VectorXd moved{tips + static_cast<Index>(readings.shank.size())};
  for (Index row = 0; row < tips; row += 3)  // along the axis it is nothing
    moved.segment<3>(row) = movedByStop(readings.tips[static_cast<std::size_t>(row / 3)], readings, plane);
  Index row = tips;
  for (const auto& [reading, side] : readings.shank)
    moved[row++] = side.dot(movedByStop(reading, readings, plane)) / readings.shank_spread;
  return moved;
}

double squareOfStops(const SwivelReadings& readings, const SwivelPlane& plane, const VectorXd& weights) {
  const VectorXd moved = movedByStops(readings, plane);
  const auto stops = stopOfEachRow(readings);
  std::map<double, double> by_stop;
  for (Index row = 0; row < moved.size(); ++row)
    by_stop[stops[static_cast<std::size_t>(row)]] += moved[row] * weights[row];
  double square = 0;
  for (const auto& [stop, sum] : by_stop) square += sum * sum;
  return square;
}

}  // namespace probebox::metrology
