#include "firmware/metrology/ball_readings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "firmware/metrology/checks.hpp"

namespace probebox::metrology {
namespace {

constexpr double kSameAngle = 1e-6;        // rad
constexpr double kInflationLimit = 400.0;  // |sin(alpha/2)| < 0.05 for two readings

template <class Angle>
bool constant(std::span<const BallReading> readings, Angle&& angle) {
  const auto first = turn(angle(readings.front()));
  return std::ranges::all_of(
      readings, [&](const BallReading& reading) { return (turn(angle(reading)) - first).norm() < kSameAngle; });
}

std::optional<Turned> turnedOf(std::span<const BallReading> readings) {
  const bool c = !constant(readings, [](const BallReading& reading) { return reading.c; });
  const bool spindle = !constant(readings, [](const BallReading& reading) { return reading.spindle; });
  if (!c && !spindle) return std::nullopt;
  if (!spindle) return Turned::c_only;
  if (!c) return Turned::spindle_only;
  const bool same = constant(readings, [](const BallReading& reading) { return reading.spindle - reading.c; });
  return same ? Turned::together : Turned::both;
}

Refusal tooClose(const std::string& which) {
  return {"angles-too-close", "the angles of the readings are equal or too close to tell " + which +
                                  ": turn the axis by 180 degrees between readings, by at least 6"};
}

std::optional<Refusal> slopeHidden(const BallModel& model, Turned turned) {
  if (!model.sloped) return std::nullopt;
  if (turned == Turned::c_only && model.stylus_per_set) {
    return Refusal{"spindle-not-turned",
                   "the spindle stood still: what its tips are off the axis cannot be told from a tilt; read with the "
                   "spindle at 0 and 180 degrees"};
  }
  if (turned == Turned::spindle_only && model.arm_per_set) {
    return Refusal{
        "c-not-turned",
        "the C axis stood still: what the balls are off the axis cannot be told from a tilt; read with C at 0 "
        "and 180 degrees"};
  }
  return std::nullopt;
}

}  // namespace

Eigen::Matrix2d turn(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return Eigen::Matrix2d{{c, -s}, {s, c}};
}

double inflation(double cofactor, std::size_t count) {
  return cofactor * static_cast<double>(count);
}

Outcome<BallFit, Refusal> fitBall(std::span<const BallReading> readings, const BallModel& model, double sigma) {
  const auto turned = turnedOf(readings);
  if (!turned) return tooClose("the axis from the ball's offset");
  if (auto refusal = slopeHidden(model, *turned)) return *refusal;
  const std::size_t sets = 1 + std::ranges::max(readings, {}, &BallReading::set).set;
  const bool merged = *turned == Turned::together;
  const std::size_t arms = model.arm_per_set || (merged && model.stylus_per_set) ? sets : 1;
  const std::size_t styli = model.stylus_per_set ? sets : 1;

  BallFit ball{.fit = {}, .turned = *turned, .arms = -1, .styli = -1};
  Eigen::Index columns = model.sloped ? 4 : 2;
  if (*turned != Turned::spindle_only) {
    ball.arms = columns;
    columns += static_cast<Eigen::Index>(2 * arms);
  }
  if (*turned == Turned::both || *turned == Turned::spindle_only) {
    ball.styli = columns;
    columns += static_cast<Eigen::Index>(2 * styli);
  }
  const auto rows = static_cast<Eigen::Index>(2 * readings.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd values{rows};
  double levers = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto& reading = readings[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    const auto column = [&](Eigen::Index first, std::size_t count) {
      return first + static_cast<Eigen::Index>(count > 1 ? 2 * reading.set : 0);
    };
    design.block<2, 2>(row, 0).setIdentity();
    if (model.sloped) design.block<2, 2>(row, 2) = reading.lever * Eigen::Matrix2d::Identity();
    if (ball.arms >= 0) design.block<2, 2>(row, column(ball.arms, arms)) = turn(reading.c);
    if (ball.styli >= 0) design.block<2, 2>(row, column(ball.styli, styli)) = -turn(reading.spindle);
    values.segment<2>(row) = reading.at;
    levers += reading.lever * reading.lever;
  }
  auto fit = linearLeastSquares(design / sigma, values / sigma);
  if (!fit) {
    return fit.error().name == "ill-conditioned" ? tooClose("the axes from the offsets of ball and stylus")
                                                 : fit.error();
  }
  const double unit = 1.0 / (sigma * sigma);
  if (inflation(fit->cofactor(0, 0) * unit, readings.size()) > kInflationLimit ||
      (model.sloped && fit->cofactor(2, 2) * unit * levers > kInflationLimit)) {
    return tooClose("the axes from the offsets of ball and stylus");
  }
  ball.fit = std::move(fit).value();
  return ball;
}

Outcome<BallTable, Refusal> readBallTable(const Dataset& dataset, std::string_view lever_column) {
  const double no_lever = 0.0;
  std::vector<std::string_view> columns{"A_rad", "C_rad", "x_mm", "y_mm"};
  if (!lever_column.empty()) columns.push_back(lever_column);
  const auto table = checkedTable(dataset, "readings", columns);
  if (!table) return table.error();
  const auto spindle_sense = configSense(dataset, "A_sense");
  if (!spindle_sense) return spindle_sense.error();
  const auto c_sense = configSense(dataset, "C_sense");
  if (!c_sense) return c_sense.error();
  const auto value = [&](std::string_view column, std::size_t row) {
    return column.empty() ? no_lever : (*(*table)->column(column))[row];
  };

  BallTable ball{.readings = {}, .warnings = equalRows(**table)};
  std::map<double, std::size_t> sets;
  const std::size_t rows = (*table)->rows();
  for (std::size_t row = 0; row < rows; ++row) {
    const double lever = value(lever_column, row);
    const auto set = sets.try_emplace(lever, sets.size()).first->second;
    ball.readings.push_back({.at = {value("x_mm", row), value("y_mm", row)},
                             .spindle = *spindle_sense * value("A_rad", row),
                             .c = *c_sense * value("C_rad", row),
                             .set = set,
                             .lever = lever});
    ball.mean_lever += lever / static_cast<double>(rows);
  }
  for (auto& reading : ball.readings) reading.lever -= ball.mean_lever;
  ball.lever_span = sets.rbegin()->first - sets.begin()->first;
  return ball;
}

}  // namespace probebox::metrology
