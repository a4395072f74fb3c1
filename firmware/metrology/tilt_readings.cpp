#include "firmware/metrology/tilt_readings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "firmware/metrology/ball_readings.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLeastSpan = 20.0;  // degrees
constexpr double kSameAngle = 1e-6;  // degrees
constexpr double kDegree = std::numbers::pi / 180.0;

std::optional<Refusal> refuseSpan(const std::vector<TiltReading>& readings) {
  const auto [least, greatest] = std::ranges::minmax(readings, {}, &TiltReading::tilt_deg);
  const double span = greatest.tilt_deg - least.tilt_deg;
  if (span >= kLeastSpan) return std::nullopt;
  return Refusal{"tilt-span-too-small", "the tilts span " + text(span) + " degrees, less than 20: tilt further"};
}

// Turns the rows of every reading along its arm and across, and takes the share of the angle out of the latter.
void weighAcross(Eigen::MatrixXd& design, Eigen::VectorXd& values, const std::vector<TiltReading>& readings,
                 const Eigen::VectorXd& fitted, double sigma, double sigma_angle) {
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(2 * k);
    const Eigen::Vector2d arm =
        turn(readings[k].tilt_deg * kDegree) * fitted.segment<2>(static_cast<Eigen::Index>(2 + 2 * readings[k].point));
    if (arm.norm() <= 0.0) continue;
    const Eigen::Vector2d along = arm.normalized();
    const double scale = sigma / std::hypot(sigma, arm.norm() * sigma_angle);
    Eigen::Matrix2d rows;
    rows << along.x(), along.y(), -along.y() * scale, along.x() * scale;
    design.middleRows<2>(row) = (rows * design.middleRows<2>(row)).eval();
    values.segment<2>(row) = (rows * values.segment<2>(row)).eval();
  }
}

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

Outcome<Eigen::Vector3d, Refusal> tiltedBall(const Dataset& dataset) {
  const auto ball = requiredVector(dataset, "ball_mm");
  if (!ball) return ball.error();
  return Eigen::Vector3d{ball->data()};
}

Outcome<Fit, Refusal> fitTilts(const std::vector<TiltReading>& readings, bool skew, double sigma, double sigma_angle) {
  if (auto refusal = refuseSpan(readings)) return *refusal;
  const std::size_t points = 1 + std::ranges::max(readings, {}, &TiltReading::point).point;
  const auto rows = static_cast<Eigen::Index>(2 * readings.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(2 + 2 * points) + (skew ? 2 : 0));
  Eigen::VectorXd values{rows};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(2 * k);
    design.block<2, 2>(row, 0).setIdentity();
    design.block<2, 2>(row, static_cast<Eigen::Index>(2 + 2 * readings[k].point)) =
        turn(readings[k].tilt_deg * kDegree);
    if (skew) design.block(row, design.cols() - 2, 2, 2) = readings[k].along * Eigen::Matrix2d::Identity();
    values.segment<2>(row) = readings[k].at;
  }
  auto fit = refuseUncertainPivot(linearLeastSquares(design / sigma, values / sigma), readings.size(), sigma);
  if (!fit || sigma_angle <= 0.0) return fit;
  weighAcross(design, values, readings, fit->parameters, sigma, sigma_angle);
  return linearLeastSquares(design / sigma, values / sigma);
}

Outcome<Fit, Refusal> refuseUncertainPivot(Outcome<Fit, Refusal> fit, std::size_t readings, double sigma) {
  if (!fit && fit.error().name != "ill-conditioned") return fit;
  // Two readings 20 degrees apart make the pivot 4 times less certain than they are; 20 times is a span that is none.
  if (fit && inflation(fit->cofactor.diagonal().head<2>().maxCoeff() / (sigma * sigma), readings) <= 400.0) return fit;
  return Refusal{"tilt-span-too-small",
                 "no point was read at tilts that differ enough: read each angle of the other axis at two or more "
                 "tilts, 20 degrees apart or more"};
}

std::optional<Refusal> refuseArm(double longest_mm, const Sigma& sigma) {
  if (!sigma.stated || longest_mm >= 5.0 * sigma.value) return std::nullopt;
  return Refusal{"arm-too-short",
                 "the ball lies " + text(longest_mm) + " mm from the axis, less than 5 sigma: move it further out"};
}

}  // namespace probebox::metrology
