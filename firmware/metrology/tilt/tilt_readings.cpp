#include "firmware/metrology/tilt/tilt_readings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "firmware/metrology/fit/angular_span.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

std::optional<Refusal> refuseSpan(const std::vector<TiltReading>& readings) {
  std::vector<double> tilts;
  for (const auto& reading : readings) tilts.push_back(reading.tilt_deg);
  const double span = angularSpan(std::move(tilts), 360.0);
  if (span >= kLeastTiltSpan_deg) return std::nullopt;
  return Refusal{"tilt-span-too-small", "the tilts span " + text(span) + " degrees, less than 20: tilt further"};
}

constexpr double kAroundEnough = 25.0;  // times the variance of the mean of the points

// Seen from the side of the axis the points lie on a circle around the other one.
double centreOf(const std::vector<std::vector<double>>& places, const std::vector<double>& angles_deg) {
  const auto points = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd design{points, 3};
  Eigen::VectorXd means{points};
  for (Eigen::Index k = 0; k < points; ++k) {
    const auto& seen = places[static_cast<std::size_t>(k)];
    const double angle = angles_deg[static_cast<std::size_t>(k)] * kDegree;
    means[k] = std::accumulate(seen.begin(), seen.end(), 0.0) / static_cast<double>(seen.size());
    design.row(k) << 1.0, std::cos(angle), std::sin(angle);
  }
  const auto fit = linearLeastSquares(design, means);
  if (!fit || inflation(fit->cofactor(0, 0), places.size()) > kAroundEnough) return means.mean();
  return fit->parameters[0];
}

// Number of the point at this angle of the other axis, as measured; that of a new one where none is at this stop.
std::size_t pointAt(const std::vector<double>& angles_deg, double angle_deg) {
  const auto near = [&](double other) { return std::abs(std::remainder(other - angle_deg, 360.0)) <= kSameStop_deg; };
  return static_cast<std::size_t>(std::ranges::find_if(angles_deg, near) - angles_deg.begin());
}

Eigen::Index armColumn(const TiltReading& reading) {
  return static_cast<Eigen::Index>(2 + 2 * reading.point);
}

}  // namespace

TiltReadings tiltReadings(const Table& table, const SwivelPlane& plane, const Eigen::Vector3d* ball) {
  std::vector<TiltReading> readings;
  std::vector<std::vector<double>> places;  // of each point, along the axis
  std::vector<double> angles_deg;           // of each, of the other axis: that of its first reading
  double apart_deg = 0.0;
  const bool head = ball != nullptr;
  const auto& tilt = *table.column(head ? column::kB : kTilt);
  const auto& other = *table.column(head ? column::kADegrees : column::kCDegrees);
  std::size_t stop = 0;
  double stop_deg = table.rows() > 0 ? tilt.front() : 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Eigen::Vector3d at{(*table.column(column::kX))[row], (*table.column(column::kY))[row],
                             (*table.column(column::kZ))[row]};
    const double turned = std::remainder(other[row], 360.0);
    const std::size_t point = pointAt(angles_deg, turned);
    if (point == angles_deg.size()) {
      places.emplace_back();
      angles_deg.push_back(turned);
    }
    apart_deg = std::max(apart_deg, std::abs(std::remainder(turned - angles_deg[point], 360.0)));
    if (std::abs(tilt[row] - stop_deg) > kSameStop_deg) {
      ++stop;
      stop_deg = tilt[row];
    }
    const Eigen::Vector3d from = head ? Eigen::Vector3d{*ball - at} : at;
    readings.push_back({plane.project(from), plane.sense * tilt[row], from[plane.axis], point, stop});
    places[point].push_back(from[plane.axis]);
  }
  const double centre = centreOf(places, angles_deg);
  for (auto& reading : readings) reading.along -= centre;
  return {std::move(readings), centre, apart_deg};
}

std::optional<std::string> anglesApart(const TiltReadings& tilts) {
  constexpr double kDigit_deg = 1e-3;
  if (tilts.apart_deg <= kDigit_deg) return std::nullopt;
  return "readings of one point have angles of C or the spindle that are " + text(tilts.apart_deg) +
         " degrees apart, which moves what stands beside that axis across it: read each point at one angle";
}

Outcome<TiltNoise, Refusal> tiltNoise(const Dataset& dataset) {
  TRY(const auto position, configSigma(dataset, "sigma_mm"));
  TRY(const auto angle, configSigma(dataset, "sigma_angle_rad"));
  if (!angle.stated) return TiltNoise{position, 0.0, {}};
  if (!position.stated) return TiltNoise{position, 0.0, {"sigma_angle_rad is not used: it also needs sigma_mm"}};
  return TiltNoise{position, angle.value, {}};
}

Outcome<Eigen::Vector3d, Refusal> tiltedBall(const Dataset& dataset) {
  TRY(const auto ball, requiredVector(dataset, "ball_mm"));
  return Eigen::Vector3d{ball.data()};
}

Outcome<Fit, Refusal> fitTilts(const std::vector<TiltReading>& readings, bool skew, const TiltNoise& noise) {
  if (auto refusal = refuseSpan(readings)) return *refusal;
  const std::size_t points = 1 + std::ranges::max(readings, {}, &TiltReading::point).point;
  const auto rows = static_cast<Eigen::Index>(2 * readings.size());
  const double sigma = noise.position.value;
  Linearised plain{Eigen::VectorXd{rows},
                   Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(2 + 2 * points) + (skew ? 2 : 0))};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(2 * k);
    plain.jacobian.block<2, 2>(row, 0).setIdentity();
    plain.jacobian.block<2, 2>(row, armColumn(readings[k])) = turn(readings[k].tilt_deg * kDegree);
    if (skew) {
      plain.jacobian.block(row, plain.jacobian.cols() - 2, 2, 2) = readings[k].along * Eigen::Matrix2d::Identity();
    }
    plain.residuals.segment<2>(row) = readings[k].at;
  }
  plain.residuals /= sigma;
  plain.jacobian /= sigma;
  auto fit = refuseUncertainPivot(linearLeastSquares(plain.jacobian, plain.residuals), readings.size(), sigma);
  if (!fit || noise.angle <= 0.0) return fit;
  Eigen::VectorXd per_radian{rows};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto arm = fit->parameters.segment<2>(armColumn(readings[k]));
    per_radian.segment<2>(static_cast<Eigen::Index>(2 * k)) =
        turn(readings[k].tilt_deg * kDegree + std::numbers::pi / 2.0) * arm / sigma;
  }
  const Linearised weighted = withoutStops(std::move(plain), readings, per_radian, noise.angle);
  return linearLeastSquares(weighted.jacobian, weighted.residuals);
}

Linearised withoutStops(Linearised rows, const std::vector<TiltReading>& readings, const Eigen::VectorXd& per_radian,
                        double sigma_angle) {
  const auto each = per_radian.size() / static_cast<Eigen::Index>(readings.size());
  for (std::size_t first = 0, next = 0; first < readings.size(); first = next) {
    while (next < readings.size() && readings[next].stop == readings[first].stop) ++next;
    const Eigen::Index at = each * static_cast<Eigen::Index>(first);
    const Eigen::Index count = each * static_cast<Eigen::Index>(next - first);
    const double lever = per_radian.segment(at, count).norm();
    if (lever <= 0.0) continue;
    const Eigen::VectorXd together = per_radian.segment(at, count) / lever;
    const double less = 1.0 - 1.0 / std::hypot(1.0, lever * sigma_angle);
    rows.residuals.segment(at, count) -= less * together.dot(rows.residuals.segment(at, count)) * together;
    rows.jacobian.middleRows(at, count) -=
        (less * together * (together.transpose() * rows.jacobian.middleRows(at, count))).eval();
  }
  return rows;
}

Outcome<Fit, Refusal> refuseUncertainPivot(Outcome<Fit, Refusal> fit, std::size_t readings, double sigma) {
  if (!fit && fit.error().name != "ill-conditioned") return fit;
  // Two readings 20 degrees apart make the pivot 4 times less certain than they are; 20 times is a span that is none.
  if (fit && inflation(fit->cofactor.diagonal().head<2>().maxCoeff() / (sigma * sigma), readings) <= 400.0) return fit;
  return Refusal{"tilt-span-too-small",
                 "no point was read at sufficiently different tilts: read each angle of the other axis at two or more "
                 "tilts, 20 degrees apart or more"};
}

std::optional<Refusal> refuseArm(double longest_mm, const Sigma& sigma) {
  if (!sigma.stated || longest_mm >= 5.0 * sigma.value) return std::nullopt;
  return Refusal{"arm-too-short",
                 "the ball lies " + text(longest_mm) + " mm from the axis, less than 5 sigma: move it further out"};
}

}  // namespace probebox::metrology
