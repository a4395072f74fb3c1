#include "firmware/metrology/tilt_readings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "firmware/metrology/checks.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLeastSpan = 20.0;  // degrees
constexpr double kSameAngle = 1e-6;  // degrees

}  // namespace

TiltReadings tiltReadings(const Table& table, const SwivelPlane& plane, const Eigen::Vector3d* ball) {
  std::vector<TiltReading> readings;
  std::map<long long, std::size_t> points;
  double mean = 0.0;
  const bool head = ball != nullptr;
  const auto& tilt = *table.column(head ? "B_deg" : "tilt_deg");
  const auto& other = *table.column(head ? "A_deg" : "C_deg");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Eigen::Vector3d at{(*table.column("x_mm"))[row], (*table.column("y_mm"))[row], (*table.column("z_mm"))[row]};
    const double turned = std::remainder(other[row], 360.0);
    const auto angle = std::llround((turned <= -180.0 + kSameAngle ? 180.0 : turned) / kSameAngle);
    const auto point = points.try_emplace(angle, points.size()).first->second;
    const Eigen::Vector3d from = head ? Eigen::Vector3d{*ball - at} : at;
    readings.push_back({plane.project(from), plane.sense * tilt[row], from[plane.axis], point});
    mean += from[plane.axis] / static_cast<double>(table.rows());
  }
  for (auto& reading : readings) reading.along -= mean;
  return {std::move(readings), mean};
}

std::optional<Refusal> refuseSpan(const std::vector<TiltReading>& readings) {
  const auto [least, greatest] = std::ranges::minmax(readings, {}, &TiltReading::tilt_deg);
  const double span = greatest.tilt_deg - least.tilt_deg;
  if (span >= kLeastSpan) return std::nullopt;
  return Refusal{"tilt-span-too-small", "the tilts span " + text(span) + " degrees, less than 20: tilt further"};
}

}  // namespace probebox::metrology
