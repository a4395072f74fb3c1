#include "firmware/metrology/centreline/centreline_x.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

// Column by which rows are parted into balls, where heights alone do not tell.
constexpr MethodColumn kBallOfX = column::kBall.orBe(MayBe::missing);
constexpr MethodColumn kColumnsOfX[]{column::kZ.orBe(MayBe::set), column::kC, column::kX, kBallOfX, kStop};
constexpr double kOneDirection = 0.05;   // of the arm's columns: |sin| of how far the angles leave one line
constexpr double kMostInflated = 400.0;  // of the variance, against the mean of as many readings at half turns

struct AxisReading {
  double x{}, height{};  // mm; height about the mean
  double c{};            // rad, right-handed about +Z
  double stop{};
  std::size_t ball{};

  // d x / d arm, of an arm in X and Y at C = 0.
  Vector2d byArm() const { return {std::cos(c), -std::sin(c)}; }
  // d x / d C.
  double byAngle(const Vector2d& arm) const { return -arm.x() * std::sin(c) - arm.y() * std::cos(c); }
};

struct AxisReadings {
  std::vector<AxisReading> rows;
  double mean_z_mm{};
  std::vector<double> heights;  // of the balls
};

Outcome<AxisReadings, Refusal> readingsOf(const Dataset& dataset, const Table& table) {
  TRY(const auto sense, configSense(dataset, "C_sense"));
  const auto& z = *table.column(column::kZ);
  const auto& c = *table.column(column::kC);
  const auto& x = *table.column(column::kX);
  const auto* numbers = table.column(kBallOfX);
  const auto* stops = table.column(kStop);
  const auto by_angle = stopsByAngle(c);
  AxisReadings all;
  for (const double each : z) all.mean_z_mm += each / static_cast<double>(z.size());
  std::vector<double> names;  // of the balls: their numbers, or the first height of each
  for (std::size_t row = 0; row < z.size(); ++row) {
    const double name = numbers != nullptr ? (*numbers)[row] : z[row];
    const double same = numbers != nullptr ? 0 : kSameHeight_mm;
    auto ball = std::ranges::find_if(names, [&](double other) { return std::abs(other - name) <= same; });
    if (ball == names.end()) ball = names.insert(names.end(), name);
    all.rows.push_back({.x = x[row],
                        .height = z[row] - all.mean_z_mm,
                        .c = sense * c[row],
                        .stop = stops != nullptr ? (*stops)[row] : by_angle[row],
                        .ball = static_cast<std::size_t>(ball - names.begin())});
  }
  for (std::size_t ball = 0; ball < names.size(); ++ball) {
    double sum = 0, count = 0;
    for (const auto& row : all.rows) {
      if (row.ball != ball) continue;
      sum += row.height;
      ++count;
    }
    all.heights.push_back(all.mean_z_mm + sum / count);
  }
  return all;
}

// Those that a case has to have, and the others where it has them.
std::vector<MethodColumn> columnsIn(const Dataset& dataset) {
  std::vector<MethodColumn> columns{std::begin(kColumnsOfX), std::begin(kColumnsOfX) + 3};
  const auto* offered = dataset.table("readings");
  for (const auto& further : {kBallOfX, kStop}) {
    if (offered != nullptr && offered->column(further) != nullptr) columns.push_back(further);
  }
  return columns;
}

double spanOf(const std::vector<double>& heights) {
  const auto [low, high] = std::ranges::minmax(heights);
  return high - low;
}

std::optional<Refusal> badReadings(const AxisReadings& all) {
  for (std::size_t ball = 0; ball < all.heights.size(); ++ball) {
    std::optional<double> first;
    bool turned = false;
    for (const auto& row : all.rows) {
      if (row.ball != ball) continue;
      turned = turned || std::abs(std::remainder(row.c - first.value_or(row.c), kTurn)) > kSameStop_rad;
      first = first.value_or(row.c);
    }
    if (turned) continue;
    return Refusal{"angles-too-close", "the ball at z = " + text(all.heights[ball]) +
                                           " mm was read at one angle of C alone, so its run-out is not told from the "
                                           "axis: read it at two angles, best half a turn apart"};
  }
  if (all.heights.size() < 2 || spanOf(all.heights) >= kLeastLengthSpan_mm) return std::nullopt;
  return Refusal{"span-too-small", "the balls are within " + text(spanOf(all.heights)) +
                                       " mm of height, less than 10: read further apart, or one ball alone for the "
                                       "place without its slope"};
}

// Which unknown stands where: c, the slope, then the arms.
struct Unknowns {
  bool sloped{};
  std::vector<Eigen::Matrix2Xd> arms;  // of each ball: the directions in which its angles tell the arm
  std::vector<Index> arm_at;
  Index count{};

  explicit Unknowns(const AxisReadings& all) : sloped{all.heights.size() > 1}, count{sloped ? 2 : 1} {
    for (std::size_t ball = 0; ball < all.heights.size(); ++ball) {
      Eigen::Matrix2d told = Eigen::Matrix2d::Zero();
      for (const auto& row : all.rows) {
        if (row.ball == ball) told += row.byArm() * row.byArm().transpose();
      }
      const SingularSystem axes = singularSystem(told);
      const bool both = axes.values[1] > kOneDirection * kOneDirection * axes.values[0];
      arms.emplace_back(axes.right.leftCols(both ? 2 : 1));
      arm_at.push_back(std::exchange(count, count + arms.back().cols()));
    }
  }

  Eigen::RowVectorXd row(const AxisReading& reading) const {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(count);
    row[0] = 1.0;
    if (sloped) row[1] = reading.height;
    const auto& along = arms[reading.ball];
    row.segment(arm_at[reading.ball], along.cols()) = reading.byArm().transpose() * along;
    return row;
  }
  Vector2d armOf(std::size_t ball, const VectorXd& parameters) const {
    return arms[ball] * parameters.segment(arm_at[ball], arms[ball].cols());
  }
};

// The angle error of a stop moves all its readings along the tangents of their arms, which a first fit tells.
Outcome<Fit, Refusal> fitAxis(const AxisReadings& all, const Unknowns& unknowns, const RotationNoise& noise) {
  const auto count = static_cast<Index>(all.rows.size());
  MatrixXd design{count, unknowns.count};
  VectorXd values{count};
  for (Index i = 0; i < count; ++i) {
    const auto& reading = all.rows[static_cast<std::size_t>(i)];
    design.row(i) = unknowns.row(reading) / noise.position;
    values[i] = reading.x / noise.position;
  }
  auto fit = linearLeastSquares(design, values);
  if (!fit || noise.angle <= 0.0) return fit;
  VectorXd moved{count};
  std::vector<double> stops;
  for (Index i = 0; i < count; ++i) {
    const auto& reading = all.rows[static_cast<std::size_t>(i)];
    moved[i] = reading.byAngle(unknowns.armOf(reading.ball, fit->parameters)) * noise.angle / noise.position;
    stops.push_back(reading.stop);
  }
  shareErrors(design, values, moved, stops);
  return linearLeastSquares(design, values);
}

// Refuses angles of C that hardly tell the arm. The fit itself refuses angles a degree apart, in general words.
Outcome<Fit, Refusal> fitKnownAxis(const AxisReadings& all, const Unknowns& unknowns, const RotationNoise& noise) {
  auto fit = fitAxis(all, unknowns, noise);
  if (!fit && fit.error().name != "ill-conditioned") return fit;
  const double of_reading = noise.position * noise.position / static_cast<double>(all.rows.size());
  if (fit && fit->cofactor(0, 0) <= kMostInflated * of_reading) return fit;
  return Refusal{"angles-too-close",
                 "the angles of C lie too close together to tell the axis from the run-out of the ball: turn C further "
                 "between readings, best by 180 degrees"};
}

void answerArms(Answer& answer, const Unknowns& unknowns, const Fit& fit) {
  std::vector<double> arms;
  for (std::size_t ball = 0; ball < unknowns.arms.size(); ++ball) {
    const Vector2d arm = unknowns.armOf(ball, fit.parameters);
    arms.insert(arms.end(), {arm.x(), arm.y()});
  }
  answer.result().also.push_back(Estimate::matrix("arms_mm", 2, std::move(arms), {}));
}

}  // namespace

Outcome<Result, Refusal> solveCentrelineX(const Dataset& dataset) {
  if (auto refusal = refuseSpindle(dataset)) return *refusal;
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto table, checkedTable(dataset, "readings", columnsIn(dataset)));
  if (table->rows() < 2)
    return Refusal{"too-few-readings", "one reading does not tell the axis: read the ball at two angles or more"};
  TRY(const auto all, readingsOf(dataset, *table));
  if (auto refusal = badReadings(all)) return *refusal;
  const Unknowns unknowns{all};
  TRY(const auto fit, fitKnownAxis(all, unknowns, noise.noise));

  Answer answer{dataset, fit, noise.sigma()};
  answer.readings(*table, {column::kX}, all.heights.size() > 1 ? column::kZ : column::kC);
  const auto of = [&](Index at) { return Eigen::RowVectorXd{pick(at, 1, unknowns.count).row(0)}; };
  answer.promiseScalar(quantity::kCentreX, fit.parameters[0], of(0));
  if (unknowns.sloped) {
    answer.promiseScalar(quantity::kCTiltX, fit.parameters[1], of(1));
    answer.alsoScalar("taper_on_diameter", 2.0 * fit.parameters[1], 2.0 * of(1));
  }
  answer.alsoScalar("centre_x_on_diameter_mm", 2.0 * fit.parameters[0], 2.0 * of(0));
  answer.result().also.push_back(Estimate::scalar(quantity::kMeanHeight, all.mean_z_mm, std::nullopt));
  answerArms(answer, unknowns, fit);
  for (const auto& warning : noise.warnings) answer.warn(warning);
  for (auto& warning : equalRows(*table)) answer.warn(std::move(warning));
  answer.result().convention =
      "X in radius, by the tip that touched; the slope is of X per mm of Z, with the straightness of the Z slide in it";
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kTablesOfX[]{
    {"readings", kColumnsOfX,
     "a ball on the part's spindle at the height z_mm and an angle of C, X in radius; column ball where balls, or "
     "clampings of one, are closer than 0.5 mm, column stop as for c-axis-alignment",
     true}};
constexpr MethodKey kKeysOfX[]{key::kSigma, key::kSigmaC, key::kCSense, key::kSpindle, key::kTauForTheRecord};
std::optional<Subject> subjectOfX(const Dataset& dataset) {
  return subjectOfSpindle(dataset, SubjectKind::centreline);
}

constexpr Quantity kResultsOfX[]{quantity::kCentreX, quantity::kCTiltX};
constexpr Quantity kFurtherOfX[]{quantity::kMeanHeight};
constexpr std::string_view kUnobservableX[]{
    "Y of the turning axis and its slope over Z: no axis of the machine moves along Y",
    "the first harmonic of EXC separately from the position of the axis, XOC",
    "the axis separately from the straightness and squareness of the Z slide: the slope is relative to Z"};

}  // namespace

const Method kCentrelineX{.name = "centreline-x",
                          .title = "Centreline of a lathe of X and Z",
                          .equations = "(B14a)",
                          .source = source::kMachine,
                          .solver = solveCentrelineX,
                          .tables = kTablesOfX,
                          .keys = kKeysOfX,
                          .results = kResultsOfX,
                          .further = kFurtherOfX,
                          .unobservable = kUnobservableX,
                          .subject = {.about = Subject{SubjectKind::centreline}, .of = subjectOfX}};

}  // namespace probebox::metrology
