#include "firmware/metrology/rotary_axis.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/least_squares.hpp"
#include "firmware/metrology/rigid.hpp"
#include "firmware/metrology/rotary_location.hpp"
#include "firmware/metrology/rotary_stack.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Balls = std::map<double, Vector3d>;

constexpr std::array<std::string_view, 5> kFirstColumns{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 4> kBallColumns{"ball", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 4> kKeys{"axis", "axis_point_mm", "axis_direction", "sigma_mm"};
constexpr double kSameAngle = 1e-8;      // rad
constexpr double kWorstResidual = 5.0;   // sigma; 4 would refuse one good case in some thousands
constexpr double kResidualFloor = 1e-5;  // mm; what the digits of a case file may round away
constexpr double kTurn = 2.0 * std::numbers::pi;
// Chi-square of six errors that the readings at phi = 0 may differ by from those with the linear axes only: 6 + 4
// sqrt(12).
constexpr double kSameState = 20.0;

// One set of balls read at one state of the axis.
struct Station {
  double angle{};
  std::vector<Vector3d> ideal;  // where the balls would be, from the axis point
  std::vector<Vector3d> read;   // where they were, from the axis point
};

// The rigid motion between ideal and read coordinates as six errors.
struct Motion {
  SixErrors errors;
  Matrix6 information;  // for unit sigma
  double squares{};     // of the residuals, mm^2
  double condition{};
};

Eigen::MatrixX3d rowsOf(const std::vector<Vector3d>& points) {
  Eigen::MatrixX3d rows{static_cast<Eigen::Index>(points.size()), 3};
  for (std::size_t k = 0; k < points.size(); ++k) rows.row(static_cast<Eigen::Index>(k)) = points[k].transpose();
  return rows;
}

Outcome<Motion, Refusal> motionOf(const Station& station) {
  const auto rigid = registerRigid(rowsOf(station.ideal), rowsOf(station.read));
  if (!rigid) {
    return Refusal{rigid.error().name,
                   "at " + text(station.angle * 360.0 / kTurn) + " degrees: " + rigid.error().reason};
  }
  Motion motion;
  motion.errors << rigid->shift, rotationVector(rigid->rotation);
  motion.information.setZero();
  const auto count = static_cast<Eigen::Index>(station.ideal.size());
  Eigen::MatrixXd design{3 * count, 6};
  for (std::size_t k = 0; k < station.ideal.size(); ++k) {
    const Vector3d left = station.read[k] - (*rigid)(station.ideal[k]);
    motion.squares += left.squaredNorm();
    design.middleRows<3>(static_cast<Eigen::Index>(3 * k)) = smallMotionRows(station.ideal[k]);
  }
  motion.information = design.transpose() * design;
  const Eigen::VectorXd norms = design.colwise().norm();
  const Eigen::VectorXd widths =
      Eigen::JacobiSVD<Eigen::MatrixXd>{design * norms.cwiseInverse().asDiagonal()}.singularValues();
  motion.condition = widths[0] / widths[5];
  if (!(motion.condition <= kConditionLimit)) {
    return Refusal{"collinear", "at " + text(station.angle * 360.0 / kTurn) +
                                    " degrees the balls do not fix six errors: measure three that are not on one line"};
  }
  return motion;
}

Outcome<Balls, Refusal> ballsOf(const Table& table) {
  Balls balls;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*table.column(kBallColumns[k]))[row]; };
    if (!balls.try_emplace(value(0), Vector3d{value(1), value(2), value(3)}).second) {
      return Refusal{"duplicated-ball",
                     "table '" + table.name + "' has ball " + text(value(0)) + " twice: give every ball once"};
    }
  }
  return balls;
}

Refusal missingBall(double ball, const char* table) {
  return {"missing-ball", "ball " + text(ball) + " of table '" + table +
                              "' is not in table 'third': give its certified coordinates, or leave it out"};
}

// Second against third: where the plate is with the axis at zero.
Outcome<Station, Refusal> plateStation(const Balls& second, const Balls& third, const NominalAxis& axis) {
  Station station;
  for (const auto& [ball, at] : second) {
    const auto certified = third.find(ball);
    if (certified == third.end()) return missingBall(ball, "second");
    station.ideal.push_back(certified->second);
    station.read.push_back(at - axis.point);
  }
  return station;
}

std::optional<Refusal> badPlate(const Station& station, const RigidMotion& plate, const Sigma& sigma) {
  if (!sigma.stated) return std::nullopt;
  for (std::size_t k = 0; k < station.ideal.size(); ++k) {
    const double off = (station.read[k] - plate(station.ideal[k])).cwiseAbs().maxCoeff();
    if (off > std::max(kWorstResidual * sigma.value, kResidualFloor)) {
      return Refusal{"residual-too-large", "row " + std::to_string(k + 1) + " of table 'second', by ball, is " +
                                               text(off) +
                                               " mm off the certificate, more than 5 sigma: measure it again"};
    }
  }
  return std::nullopt;
}

// Stations at the sorted distinct angles of first, for a plate at `plate` (its balls from the axis point at zero).
Outcome<std::vector<Station>, Refusal> stationsOf(const Table& first, const Balls& third, const NominalAxis& axis,
                                                  const RigidMotion& plate) {
  std::vector<double> angles = *first.column("phi_rad");
  std::ranges::sort(angles);
  const auto same = [](double a, double b) { return std::abs(a - b) < kSameAngle; };
  angles.erase(std::ranges::unique(angles, same).begin(), angles.end());
  std::vector<Station> stations(angles.size());
  for (std::size_t k = 0; k < angles.size(); ++k) stations[k].angle = angles[k];
  for (std::size_t row = 0; row < first.rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*first.column(kFirstColumns[k]))[row]; };
    const auto certified = third.find(value(1));
    if (certified == third.end()) return missingBall(value(1), "first");
    const auto at = std::ranges::lower_bound(angles, value(0) - kSameAngle) - angles.begin();
    Station& station = stations[static_cast<std::size_t>(at)];
    const Eigen::AngleAxisd turned{station.angle, axis.direction};
    station.ideal.push_back(turned * plate(certified->second));
    station.read.push_back(Vector3d{value(2), value(3), value(4)} - axis.point);
  }
  return stations;
}

bool atZero(double angle) {
  return std::abs(std::remainder(angle, kTurn)) < kSameAngle;
}

// An error of the plate's place, as seen after the axis has turned it.
Matrix6 turnedPlate(const NominalAxis& axis, double angle) {
  const Matrix3d turned = Eigen::AngleAxisd{angle, axis.direction}.toRotationMatrix();
  Matrix6 both = Matrix6::Zero();
  both.topLeftCorner<3, 3>() = turned;
  both.bottomRightCorner<3, 3>() = turned;
  return both;
}

// Six errors at every angle, and their covariance for unit sigma.
struct Errors {
  std::vector<double> angles;
  Eigen::VectorXd values;
  Eigen::MatrixXd cofactor;
  double squares{};
  std::size_t dof{};
  double condition{};
  bool zero_agrees{true};
  Residuals residuals{.unit = "mm", .against = "phi_rad", .names = {}, .at = {}, .values = {}};
};

// What the rigid motion of one angle leaves of the balls, in the order of their rows.
void addResiduals(Residuals& residuals, const Station& station) {
  const auto rigid = registerRigid(rowsOf(station.ideal), rowsOf(station.read));
  if (!rigid) return;
  for (std::size_t k = 0; k < station.ideal.size(); ++k) {
    const Vector3d left = station.read[k] - (*rigid)(station.ideal[k]);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      residuals.names.push_back("first, " + text(station.angle * 360.0 / kTurn) + " degrees, ball " +
                                std::to_string(k + 1) + " of the angle, " +
                                std::string{kBallColumns[static_cast<std::size_t>(axis) + 1]});
      residuals.at.push_back(station.angle);
      residuals.values.push_back(left[axis]);
    }
  }
}

// The plate is refined by the readings at phi = 0 where they agree with it: the axis stands there in both, so what they
// differ by is noise. The row of phi = 0 stays the plain difference of the two.
Outcome<Errors, Refusal> errorsOf(const std::vector<Station>& stations, const NominalAxis& axis, const Motion& second,
                                  const Sigma& sigma) {
  const auto count = static_cast<Eigen::Index>(stations.size());
  Errors errors;
  errors.values.resize(6 * count);
  errors.cofactor = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  std::vector<Motion> motions;
  for (const auto& station : stations) {
    const auto motion = motionOf(station);
    if (!motion) return motion.error();
    motions.push_back(motion.value());
    errors.squares += motion->squares;
    errors.dof += 3 * station.ideal.size() - 6;
    errors.condition = std::max(errors.condition, motion->condition);
    errors.angles.push_back(station.angle);
    addResiduals(errors.residuals, station);
  }
  // Shift of the plate that the readings at zero ask for, and what remains uncertain of the plate.
  SixErrors shift = SixErrors::Zero();
  Matrix6 plate = second.information.inverse();
  for (std::size_t k = 0; k < stations.size(); ++k) {
    if (!atZero(stations[k].angle)) continue;
    const Matrix6 difference = plate + motions[k].information.inverse();
    const double pooled =
        sigma.stated ? sigma.value * sigma.value
                     : (errors.squares + second.squares) / static_cast<double>(std::max<std::size_t>(errors.dof, 1));
    const double chi2 = motions[k].errors.dot(difference.inverse() * motions[k].errors) / pooled;
    errors.zero_agrees = errors.zero_agrees && chi2 <= kSameState;
  }
  if (errors.zero_agrees) {
    Matrix6 information = second.information;
    SixErrors weighted = SixErrors::Zero();
    for (std::size_t k = 0; k < stations.size(); ++k) {
      if (!atZero(stations[k].angle)) continue;
      information += motions[k].information;
      weighted += motions[k].information * motions[k].errors;
    }
    plate = information.inverse();
    shift = plate * weighted;
  }
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& station = stations[static_cast<std::size_t>(k)];
    const auto& motion = motions[static_cast<std::size_t>(k)];
    const bool zero = atZero(station.angle) && errors.zero_agrees;
    const Matrix6 seen = turnedPlate(axis, station.angle);
    errors.values.segment<6>(6 * k) = motion.errors;
    if (!zero) errors.values.segment<6>(6 * k) -= seen * shift;
    errors.cofactor.block<6, 6>(6 * k, 6 * k) = motion.information.inverse();
    for (Eigen::Index l = 0; l < count; ++l) {
      const auto& other = stations[static_cast<std::size_t>(l)];
      const bool other_zero = atZero(other.angle) && errors.zero_agrees;
      if (zero && other_zero) {
        errors.cofactor.block<6, 6>(6 * k, 6 * l) += second.information.inverse();
      } else if (!zero && !other_zero) {
        errors.cofactor.block<6, 6>(6 * k, 6 * l) += seen * plate * turnedPlate(axis, other.angle).transpose();
      }
    }
  }
  return errors;
}

std::vector<double> sdOf(const Eigen::MatrixXd& map, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd variance = (map * covariance).cwiseProduct(map).rowwise().sum();
  const Eigen::VectorXd sd = variance.cwiseMax(0.0).cwiseSqrt();
  return {sd.begin(), sd.end()};
}

// Factor on the cofactor; nothing where neither sigma nor residuals are there.
std::optional<double> varianceOf(Result& result, const Sigma& sigma) {
  if (result.dof == 0) return sigma.stated ? std::optional<double>{sigma.value * sigma.value} : std::nullopt;
  const double pooled = result.rms * result.rms;
  if (!sigma.stated) return pooled;
  const double stated = sigma.value * sigma.value;
  result.chi2_reduced = pooled / stated;
  if (*result.chi2_reduced <= 1.0 + 4.0 * std::sqrt(2.0 / static_cast<double>(result.dof))) return stated;
  result.warnings.push_back("the readings agree worse than the stated sigma promises (reduced chi-square " +
                            text(*result.chi2_reduced) + "): the sd is widened by its root; look for a bad reading");
  return pooled;
}

}  // namespace

Eigen::Vector3d chainError(std::span<const RotaryLink> links, const Eigen::Vector3d& point) {
  Vector3d at = point;
  Vector3d off = Vector3d::Zero();
  for (auto link = links.rbegin(); link != links.rend(); ++link) {
    const Eigen::AngleAxisd turned{link->angle, link->direction.normalized()};
    at = link->point + turned * (at - link->point);
    off = turned * off + smallMotionRows(at - link->point) * link->errors;
  }
  return off;
}

Outcome<Result, Refusal> solveRotaryAxisErrors(const Dataset& dataset) {
  if (asksForStack(dataset)) return solveRotaryStack(dataset);
  const auto axis = nominalAxis(dataset);
  if (!axis) return axis.error();
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const auto first = checkedTable(dataset, "first", kFirstColumns);
  if (!first) return first.error();
  const auto second_table = checkedTable(dataset, "second", kBallColumns);
  if (!second_table) return second_table.error();
  const auto third_table = checkedTable(dataset, "third", kBallColumns);
  if (!third_table) return third_table.error();
  const auto second = ballsOf(**second_table);
  if (!second) return second.error();
  const auto third = ballsOf(**third_table);
  if (!third) return third.error();

  auto placed = plateStation(second.value(), third.value(), axis.value());
  if (!placed) return placed.error();
  const auto plate = registerRigid(rowsOf(placed->ideal), rowsOf(placed->read));
  if (!plate) return Refusal{plate.error().name, "table 'second': " + plate.error().reason};
  if (auto refusal = badPlate(placed.value(), plate.value(), sigma.value())) return *refusal;
  for (auto& ball : placed->ideal) ball = (*plate)(ball);
  const auto place = motionOf(placed.value());
  if (!place) return place.error();
  const auto stations = stationsOf(**first, third.value(), axis.value(), plate.value());
  if (!stations) return stations.error();
  const auto errors = errorsOf(stations.value(), axis.value(), place.value(), sigma.value());
  if (!errors) return errors.error();

  Result result;
  result.method = dataset.method;
  result.dof = errors->dof + 3 * placed->ideal.size() - 6;
  result.rms =
      std::sqrt((errors->squares + place->squares) / static_cast<double>(std::max<std::size_t>(result.dof, 1)));
  result.condition = std::max(errors->condition, place->condition);
  const auto variance = varianceOf(result, sigma.value());
  const auto add = [&](const char* key, std::size_t columns, const Eigen::MatrixXd& map) {
    const Eigen::VectorXd values = map * errors->values;
    std::vector<double> sd;
    if (variance) sd = sdOf(map, errors->cofactor * *variance);
    const std::vector<double> list{values.begin(), values.end()};
    const auto design = sdOf(map, errors->cofactor);
    result.estimates.push_back(columns > 1 ? Estimate::matrix(key, columns, list, std::move(sd))
                                           : Estimate::vector(key, list, std::move(sd)));
    result.estimates.back().design = design;
  };
  result.design_per = "one coordinate of one ball, mm";
  result.residuals = errors->residuals;
  add("six_errors", 6, Eigen::MatrixXd::Identity(errors->values.size(), errors->values.size()));
  result.also.push_back(Estimate::vector("angle_rad", errors->angles, {}));
  if (locationKnown(errors->angles)) {
    add("location_mm", 1, locationMap(errors->angles, axis->direction, 0));
    add("tilt_rad", 1, locationMap(errors->angles, axis->direction, 3));
  } else {
    result.warnings.emplace_back(
        "no location of the axis: it needs four or more angles that are spread wider than 60 degrees");
  }
  if (!errors->zero_agrees) {
    result.warnings.emplace_back(
        "the first coordinates at phi = 0 disagree with the second ones, so they are left out of the plate's place: "
        "did "
        "the axis return to zero?");
  }
  if (!variance) result.warnings.emplace_back("no sd: no sigma_mm is stated and there are no more balls than needed");
  for (auto& warning : unusedKeys(dataset, kKeys)) result.warnings.push_back(std::move(warning));
  result.convention = "EX EY EZ EA EB EC of the table at each angle, about axis_point_mm, relative to the axis at zero";
  return result;
}

}  // namespace probebox::metrology
