#include "firmware/procedure/dataset/hold_readings.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/reading_tables.hpp"
#include "firmware/procedure/plan/methods.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using metrology::Refusal;
using metrology::Table;

constexpr std::array<std::string_view, 6> kMoveColumns{"ux_mm", "uy_mm", "uz_mm", "s1", "s2", "s3"};
constexpr std::array<std::string_view, 19> kHoldColumns{
    "touch", "reading", "ball", "tool",    "A_rad",   "B_rad",   "C_rad", "x_mm",  "y_mm", "z_mm",
    "s1",    "s2",      "s3",   "sd_x_mm", "sd_y_mm", "sd_z_mm", "sd_s1", "sd_s2", "sd_s3"};

// Mean of one column over the rows of a hold, and the sd of that mean.
struct Mean {
  double value{};
  double sd{};
};

// From the means of ten parts, one after the other: what sways more slowly than the samples come does not average away
// as their noise does.
Mean meanOf(std::span<const double> values) {
  const std::size_t parts = std::min<std::size_t>(10, values.size());
  const auto meanOver = [](std::span<const double> some) {
    double sum = 0;
    for (const double value : some) sum += value;
    return sum / static_cast<double>(some.size());
  };
  Mean mean{.value = meanOver(values), .sd = 0};
  double squares = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t from = part * values.size() / parts, to = (part + 1) * values.size() / parts;
    const double off = meanOver(values.subspan(from, to - from)) - mean.value;
    squares += off * off;
  }
  mean.sd = std::sqrt(squares / static_cast<double>(parts * (parts - 1)));
  return mean;
}

struct Hold {
  const capture::TouchRequest* request{};
  Vector3d at_mm, sd_at_mm;
  Vector3d sensors, sd_sensors;
};

// Means of three columns, row by row of the touches: their rows stand one touch after the other.
void average(const Table& table, const std::array<const char*, 3>& columns, std::vector<Hold>& holds,
             Vector3d Hold::*mean, Vector3d Hold::*sd) {
  const auto& touch = *table.column("touch");
  std::size_t from = 0;
  for (auto& hold : holds) {
    std::size_t to = from;
    while (to < touch.size() && touch[to] == static_cast<double>(hold.request->step)) ++to;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto [value, sd_of_mean] = meanOf(std::span{*table.column(columns[i])}.subspan(from, to - from));
      (hold.*mean)[static_cast<Index>(i)] = value;
      (hold.*sd)[static_cast<Index>(i)] = sd_of_mean;
    }
    from = to;
  }
}

std::vector<Hold> holdsOf(const metrology::Dataset& rows, const capture::Recording& recording) {
  std::vector<Hold> holds;
  for (const auto& touch : recording.touches()) holds.push_back({&touch.request, {}, {}, {}, {}});
  average(*rows.table("machine"), {"x_mm", "y_mm", "z_mm"}, holds, &Hold::at_mm, &Hold::sd_at_mm);
  average(*rows.table("probe"), {"a", "b", "c"}, holds, &Hold::sensors, &Hold::sd_sensors);
  return holds;
}

Table tableOf(const std::vector<Hold>& holds) {
  auto table = Table::withColumns("holds", kHoldColumns);
  for (const auto& hold : holds) {
    const auto& request = *hold.request;
    const auto& [a, b, c] = request.rotary_angles_rad;
    const auto& [at, sensors, sd_at, sd_sensors] = std::tie(hold.at_mm, hold.sensors, hold.sd_at_mm, hold.sd_sensors);
    table.append({static_cast<double>(request.step), static_cast<double>(request.reading),
                  static_cast<double>(request.ball), static_cast<double>(request.tool), a, b, c, at[0], at[1], at[2],
                  sensors[0], sensors[1], sensors[2], sd_at[0], sd_at[1], sd_at[2], sd_sensors[0], sd_sensors[1],
                  sd_sensors[2]});
  }
  return table;
}

// The machine moves the head, so the ball goes the other way.
void addMoves(metrology::Dataset& dataset, const std::vector<Hold>& holds) {
  Vector3d reference = Vector3d::Zero();
  for (const auto& hold : holds) reference += hold.at_mm / static_cast<double>(holds.size());
  auto moves = Table::withColumns("moves", kMoveColumns);
  for (const auto& hold : holds) {
    const Vector3d u = reference - hold.at_mm;
    moves.append({u.x(), u.y(), u.z(), hold.sensors[0], hold.sensors[1], hold.sensors[2]});
  }
  if (!holds.empty()) dataset.config["tool"] = static_cast<double>(holds.front().request->tool);
  dataset.config["reference_mm"] = std::vector<double>{reference.begin(), reference.end()};
  dataset.tables.insert(dataset.tables.begin(), std::move(moves));
}

Matrix3d matrixOf(const std::array<std::array<double, 3>, 3>& rows) {
  Matrix3d matrix;
  for (Index i = 0; i < 3; ++i) matrix.row(i) = vectorOf(rows[static_cast<std::size_t>(i)]).transpose();
  return matrix;
}

// What an uncertain K makes of a displacement: the sd of the three coordinates.
Vector3d sdByMatrix(const Matrix3d& inverse, const Matrix3d& sd, const Vector3d& displacement) {
  const Vector3d of_sensors = (sd.cwiseAbs2() * displacement.cwiseAbs2()).cwiseSqrt();
  return (inverse.cwiseAbs2() * of_sensors.cwiseAbs2()).cwiseSqrt();
}

// What K is off by moves all readings alike as far as the ball stands at the same place in the head: that part is
// common to all of them, and the rest belongs to each.
void addBalls(metrology::Dataset& dataset, const std::vector<Hold>& holds, const SensorHead& head,
              const CalibratedHead& calibrated, const Facts& facts) {
  const Matrix3d inverse = metrology::inverse(matrixOf(calibrated.matrix)), sd = matrixOf(calibrated.sd);
  Vector3d usual = Vector3d::Zero();
  for (const auto& hold : holds) usual += inverse * hold.sensors / static_cast<double>(holds.size());
  std::vector<Reading> readings;
  for (const auto& hold : holds) {
    const auto& request = *hold.request;
    const Vector3d u = inverse * hold.sensors;
    const Vector3d variance = hold.sd_at_mm.cwiseAbs2() + inverse.cwiseAbs2() * hold.sd_sensors.cwiseAbs2() +
                              sdByMatrix(inverse, sd, u - usual).cwiseAbs2();
    readings.push_back({.number = static_cast<double>(request.reading),
                        .ball = static_cast<double>(request.ball),
                        .a_rad = request.rotary_angles_rad[0],
                        .b_rad = request.rotary_angles_rad[1],
                        .c_rad = request.rotary_angles_rad[2],
                        .tool = request.tool,
                        .centre = {.centre_mm = hold.at_mm + vectorOf(head.centre_offset_mm) + u,
                                   .sd_mm = variance.cwiseSqrt(),
                                   .radius_mm = 0}});
  }
  addPlate(dataset, readings, *facts.ball_plate, facts);
  auto& config = dataset.config;
  const double of_matrix_mm = sdByMatrix(inverse, sd, usual).norm() / std::sqrt(3.0);
  config["sigma_offset_mm"] = std::hypot(head.sd_centre_offset_mm, of_matrix_mm);
  config["tool_vector_mm"] = std::vector<double>{head.centre_offset_mm.begin(), head.centre_offset_mm.end()};
  metrology::Matrix matrix;
  for (const auto& row : calibrated.matrix) matrix.emplace_back(row.begin(), row.end());
  config["sensor_matrix"] = matrix;
  config["sensor_head_result"] = static_cast<double>(calibrated.result_id);
}

}  // namespace

RunDataset holdsDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                        const Facts& facts) {
  RunDataset run{capture::touchDataset(recording, scales, std::string{nameOf(method)}), {}, {}};
  auto& dataset = run.dataset;
  std::erase_if(dataset.tables, [](const Table& table) { return table.name == "touches"; });
  const auto holds = holdsOf(dataset, recording);
  dataset.tables.push_back(tableOf(holds));
  if (needsHead(method)) {
    addMoves(dataset, holds);
    return run;
  }
  const auto& head = facts.sensor_head;
  if (!head || !head->calibrated) {
    run.refusal = Refusal{"no-sensor-head",
                          "no calibration of the sensor head is in force, so its readings cannot be converted: "
                          "calibrate it first, accept it, and measure again"};
    return run;
  }
  addBalls(dataset, holds, *head, *head->calibrated, facts);
  return run;
}

}  // namespace probebox::procedure
