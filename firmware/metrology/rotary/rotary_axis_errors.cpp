#include "firmware/metrology/rotary/rotary_axis_errors.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/rotary/rotary_joint_errors.hpp"
#include "firmware/metrology/rotary/rotary_location.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Balls = std::map<double, Vector3d>;

constexpr MethodColumn kFirstColumns[]{column::kPhi, column::kBall, column::kX, column::kY, column::kZ, kMount};
constexpr MethodColumn kBallColumns[]{column::kBall, column::kX, column::kY, column::kZ, kMount};
constexpr MethodColumn kCertifiedColumns[]{column::kBall, column::kSetX, column::kSetY, column::kSetZ};
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
  Matrix6d information;  // for unit sigma
  Eigen::VectorXd left;  // residuals, mm, three a ball
  double condition{};

  std::size_t dof() const { return static_cast<std::size_t>(left.size()) - 6; }
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
  const auto count = static_cast<Eigen::Index>(station.ideal.size());
  Eigen::MatrixXd design{3 * count, 6};
  motion.left.resize(3 * count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto ball = static_cast<std::size_t>(k);
    motion.left.segment<3>(3 * k) = station.read[ball] - (*rigid)(station.ideal[ball]);
    design.middleRows<3>(3 * k) = smallMotionRows(station.ideal[ball]);
  }
  motion.information = design.transpose() * design;
  motion.condition = scaledCondition(motion.information);
  if (!(motion.condition <= kConditionLimit)) {
    return Refusal{"collinear",
                   "at " + text(station.angle * 360.0 / kTurn) +
                       " degrees the balls do not determine six errors: measure three that are not on one line"};
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
                              "' is not in table 'third': give its certified coordinates, or omit it"};
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
    if (off > std::max(kWorstResidual_sigma * sigma.value, kBallResidualFloor_mm)) {
      return Refusal{"residual-too-large",
                     "row " + std::to_string(k + 1) + " of table 'second', by ball, is " + text(off) +
                         " mm from the certified position, more than 5 sigma: measure this ball again"};
    }
  }
  return std::nullopt;
}

// Stations at the sorted distinct angles of first, for a plate at `plate` (its balls from the axis point at zero).
Outcome<std::vector<Station>, Refusal> stationsOf(const Table& first, const Balls& third, const NominalAxis& axis,
                                                  const RigidMotion& plate) {
  const std::vector<double> angles = distinctAngles(*first.column(column::kPhi));
  std::vector<Station> stations(angles.size());
  for (std::size_t k = 0; k < angles.size(); ++k) stations[k].angle = angles[k];
  for (std::size_t row = 0; row < first.rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*first.column(kFirstColumns[k]))[row]; };
    const auto certified = third.find(value(1));
    if (certified == third.end()) return missingBall(value(1), "first");
    const auto at = std::ranges::lower_bound(angles, value(0) - kSameTableAngle_rad) - angles.begin();
    Station& station = stations[static_cast<std::size_t>(at)];
    const Eigen::AngleAxisd turned{station.angle, axis.direction};
    station.ideal.push_back(turned * plate(certified->second));
    station.read.push_back(Vector3d{value(2), value(3), value(4)} - axis.point);
  }
  return stations;
}

bool atZero(double angle) {
  return std::abs(std::remainder(angle, kTurn)) < kSameTableAngle_rad;
}

// An error of the plate's place, as seen after the axis has turned it.
Matrix6d turnedPlate(const NominalAxis& axis, double angle) {
  const Matrix3d turned = Eigen::AngleAxisd{angle, axis.direction}.toRotationMatrix();
  Matrix6d both = Matrix6d::Zero();
  both.topLeftCorner<3, 3>() = turned;
  both.bottomRightCorner<3, 3>() = turned;
  return both;
}

// Adds the residuals of the balls from the rigid motion of one angle, in the order of their rows.
void addResiduals(Residuals& residuals, const Station& station, const Motion& motion) {
  for (Eigen::Index k = 0; k < motion.left.size(); ++k) {
    residuals.names.push_back("first, " + text(station.angle * 360.0 / kTurn) + " degrees, ball " +
                              std::to_string(k / 3 + 1) + " of the angle, " +
                              std::string{kBallColumns[static_cast<std::size_t>(k % 3) + 1]});
    residuals.at.push_back(station.angle);
    residuals.values.push_back(motion.left[k]);
  }
}

// The rigid motions of all angles, and that of the plate.
struct Motions {
  std::vector<Motion> first;
  Motion second;

  std::size_t dof() const {
    std::size_t dof = second.dof();
    for (const auto& motion : first) dof += motion.dof();
    return dof;
  }
  Eigen::VectorXd left() const {
    std::vector<double> all;
    for (const auto& motion : first) all.insert(all.end(), motion.left.begin(), motion.left.end());
    all.insert(all.end(), second.left.begin(), second.left.end());
    return Eigen::VectorXd::Map(all.data(), static_cast<Eigen::Index>(all.size()));
  }
  double condition() const {
    double worst = second.condition;
    for (const auto& motion : first) worst = std::max(worst, motion.condition);
    return worst;
  }
};

Outcome<Motions, Refusal> motionsOf(const std::vector<Station>& stations, const Motion& second) {
  Motions motions{{}, second};
  for (const auto& station : stations) {
    TRY(const auto motion, motionOf(station));
    motions.first.push_back(motion);
  }
  return motions;
}

// Whether the readings at phi = 0 differ from the second ones by no more than noise: the axis stands there in both.
bool zeroAgrees(const std::vector<Station>& stations, const Motions& motions, const Sigma& sigma) {
  const double found = motions.left().squaredNorm() / static_cast<double>(std::max<std::size_t>(motions.dof(), 1));
  const double variance = sigma.stated ? sigma.value * sigma.value : found;
  for (std::size_t k = 0; k < stations.size(); ++k) {
    if (!atZero(stations[k].angle)) continue;
    const Motion& motion = motions.first[k];
    const Matrix6d difference = inverse(motions.second.information) + inverse(motion.information);
    if (motion.errors.dot(inverse(difference) * motion.errors) > kSameState * variance) return false;
  }
  return true;
}

// How far the readings at zero move the plate, and what remains uncertain of its place, for unit sigma.
struct PlatePlace {
  SixErrors shift = SixErrors::Zero();
  Matrix6d cofactor;
};

PlatePlace plateOf(const std::vector<Station>& stations, const Motions& motions, bool zero_agrees) {
  Matrix6d information = motions.second.information;
  SixErrors weighted = SixErrors::Zero();
  for (std::size_t k = 0; zero_agrees && k < stations.size(); ++k) {
    if (!atZero(stations[k].angle)) continue;
    information += motions.first[k].information;
    weighted += motions.first[k].information * motions.first[k].errors;
  }
  const Matrix6d cofactor = inverse(information);
  return {cofactor * weighted, cofactor};
}

// Six errors at every angle. The plate is refined by the readings at phi = 0 where they agree with it; their own row
// stays the plain difference of the two.
AngleErrors errorsOf(const std::vector<Station>& stations, const NominalAxis& axis, const Motions& motions,
                     bool zero_agrees, double sigma) {
  const PlatePlace plate = plateOf(stations, motions, zero_agrees);
  AngleErrors errors;
  errors.six.resize(6 * static_cast<Eigen::Index>(stations.size()));
  // All angles share the place of the plate; those at zero its place by the second coordinates alone.
  errors.cofactor.common = Eigen::MatrixXd::Zero(12, 12);
  errors.cofactor.common.topLeftCorner<6, 6>() = plate.cofactor * sigma * sigma;
  errors.cofactor.common.bottomRightCorner<6, 6>() = inverse(motions.second.information) * sigma * sigma;
  for (std::size_t k = 0; k < stations.size(); ++k) {
    const Motion& motion = motions.first[k];
    const Matrix6d seen = turnedPlate(axis, stations[k].angle);
    const bool is_zero = zero_agrees && atZero(stations[k].angle);
    auto six = errors.six.segment<6>(6 * static_cast<Eigen::Index>(k));
    six = motion.errors;
    if (!is_zero) six -= seen * plate.shift;
    Eigen::MatrixXd carried = Eigen::MatrixXd::Zero(6, 12);
    carried.middleCols<6>(is_zero ? 6 : 0) = is_zero ? Matrix6d{Matrix6d::Identity()} : seen;
    errors.angles.push_back(stations[k].angle);
    errors.cofactor.own.emplace_back(inverse(motion.information) * sigma * sigma);
    errors.cofactor.carried.push_back(std::move(carried));
  }
  return errors;
}

// Content of a case, read and checked: the plate where second and third put it, the stations of first.
struct Bench {
  NominalAxis axis;
  Sigma sigma;
  Motion plate;
  std::vector<Station> stations;
};

Outcome<Bench, Refusal> benchOf(const Dataset& dataset) {
  TRY(const auto axis, nominalAxis(dataset));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto first, checkedTable(dataset, "first", std::span{kFirstColumns}.first(5)));
  TRY(const auto second_table, checkedTable(dataset, "second", std::span{kBallColumns}.first(4)));
  TRY(const auto third_table, checkedTable(dataset, "third", kCertifiedColumns));
  TRY(const auto second, ballsOf(*second_table));
  TRY(const auto third, ballsOf(*third_table));
  TRY(auto placed, plateStation(second, third, axis));
  const auto plate = registerRigid(rowsOf(placed.ideal), rowsOf(placed.read));
  if (!plate) return Refusal{plate.error().name, "table 'second': " + plate.error().reason};
  if (auto refusal = badPlate(placed, plate.value(), sigma)) return *refusal;
  for (auto& ball : placed.ideal) ball = (*plate)(ball);
  TRY(const auto place, motionOf(placed));
  TRY(auto stations, stationsOf(*first, third, axis, plate.value()));
  return Bench{axis, sigma, place, std::move(stations)};
}

// Whether a case of "rotary-axis-errors" needs one fit of everything: tables with a column `mount`, station_correction
// switched on, or a sigma beside that of every coordinate.
bool asksForStack(const Dataset& dataset) {
  const Table* first = dataset.table("first");
  const auto correct = dataset.config.find("station_correction");
  const bool corrected = correct != dataset.config.end() && correct->second != Value{false};
  const bool weighs = std::ranges::any_of(kOtherSigmas, [&](auto key) { return dataset.config.contains(key); });
  return (first && first->column(kMount)) || corrected || weighs;
}

}  // namespace

Outcome<Result, Refusal> solveRotaryAxisErrors(const Dataset& dataset) {
  if (asksForStack(dataset)) return solveRotaryStack(dataset);
  TRY(const auto bench, benchOf(dataset));
  const auto& stations = bench.stations;
  TRY(const auto motions, motionsOf(stations, bench.plate));
  const bool zero_agrees = zeroAgrees(stations, motions, bench.sigma);
  const double sigma = bench.sigma.value;
  const auto errors = errorsOf(stations, bench.axis, motions, zero_agrees, sigma);
  if (auto refusal = tooLargeErrors(errors.angles, errors.six)) return *refusal;

  Fit quality;
  quality.residuals = motions.left() / sigma;
  quality.dof = motions.dof();
  quality.condition = motions.condition();
  Answer answer = answerOf(dataset, bench.sigma, std::move(quality), errors, bench.axis.direction);
  answer.readingIs("one coordinate of one ball", "mm");
  answer.result().residuals.against = column::kPhi.name;
  for (std::size_t k = 0; k < stations.size(); ++k)
    addResiduals(answer.result().residuals, stations[k], motions.first[k]);
  addNominalAxis(answer.result(), bench.axis);
  if (!zero_agrees) {
    answer.warn(
        std::string{kReadingsContradict} +
        ": the first coordinates at phi = 0 disagree with the second ones and are not used for the position of the "
        "plate: check that the axis returned to zero");
  }
  if (dataset.config.contains(kStationRadiusKey)) answer.warn(unusedKey(kStationRadiusKey, dataset.method));
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kAxisErrorsTables[]{
    {"first", kFirstColumns, "centre of a ball with the axis turned to phi; column mount where there are several",
     true},
    {"second", kBallColumns, "centre of a ball with the axis at zero; column mount where there are several", true},
    {"third", kCertifiedColumns, "centre of a ball in the certificate, in the plate's own frame"}};
constexpr MethodKey kAxisErrorsKeys[]{
    {"axis_point_mm", kNeeded, "a point of the nominal axis"},
    {"axis_direction", kNeeded, "unit vector along the nominal axis"},
    {"axis", "", "letter of the axis, needed by the box"},
    key::kSigma,
    {"sigma_axial_mm", "sigma_mm", "standard deviation of a coordinate along the axis (k = 1)"},
    key::kSigmaAngle,
    {"sigma_third_mm", "0", "standard deviation of a coordinate of the certificate (k = 1)"},
    {"sigma_offset_mm", "0", "standard deviation of the error that all readings share (k = 1)"},
    {"station_correction", "false", "true: remove the error of the linear axes at each station"},
    {kStationRadiusKey, "30", "largest distance of a ball from its station, mm; with station_correction"},
    key::kTauForTheRecord,
    {"tool_vector_mm", "", "from the machine's position to the reference of the sensor head; for the record"},
    {"sensor_matrix", "", "units of the sensors per mm, one row per sensor; for the record"},
    {"sensor_head_result", "", "number of the sensor head's calibration; for the record", SubjectKind::sensor_head}};
constexpr KnownQuantity kKnown[]{
    {"sd_certificate_mm", "third", KnownKind::table, false, "certificate of the ball plate"}};
constexpr Quantity kAxisErrorsResults[]{quantity::kSixErrors, quantity::kLocation, quantity::kTilt};
constexpr Quantity kAxisErrorsFurther[]{
    quantity::kErrorMotions,  quantity::kTiltMotions,
    quantity::kErrorAngles,   quantity::kAxisPoint,
    quantity::kAxisDirection, {.key = "rotations_rad", .kind = QuantityKind::lean}};  // partsOf()
constexpr std::string_view kAxisErrorsUnobservable[]{
    "XOC and YOC separately from position-dependent first harmonics (EXC, EYC)",
    "any error at the reference angle, and errors of the linear axes that all angles share"};

std::optional<Subject> subjectOfAxis(const Dataset& dataset) {
  return letteredSubject(dataset, SubjectKind::rotary);
}

}  // namespace

std::string deviationKey(std::string_view axis, std::size_t error, double angle_rad) {
  constexpr std::array<const char*, 6> kErrors{"X", "Y", "Z", "A", "B", "C"};
  std::array<char, 48> at{};
  std::snprintf(at.data(), at.size(), "_at_%.6g_deg_%s", degrees(angle_rad), error < 3 ? "mm" : "rad");
  return std::string{quantity::kDeviation.key} + kErrors.at(error) + std::string{axis} + at.data();
}

const Method kRotaryAxisErrors{.name = "rotary-axis-errors",
                               .title = "Errors of a rotary axis",
                               .equations = "(E2)-(E12)",
                               .source = source::kRotary,
                               .solver = solveRotaryAxisErrors,
                               .tables = kAxisErrorsTables,
                               .keys = kAxisErrorsKeys,
                               .known = kKnown,
                               .results = kAxisErrorsResults,
                               .further = kAxisErrorsFurther,
                               .unobservable = kAxisErrorsUnobservable,
                               .subject = {.of = subjectOfAxis}};

}  // namespace probebox::metrology
