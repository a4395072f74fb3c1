#include "firmware/metrology/rotary/rotary_axis_errors.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/hold_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<std::string_view, 5> kPlateColumns{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};

constexpr Fact kBallPlate{
    .place = "`[ball_plate]`",
    .known = [](const Facts& facts) { return facts.ball_plate.has_value(); },
    .missing = "the certified positions of the balls: give [ball_plate] and its balls in machine.toml."};
constexpr std::array kNeeds{&kBallPlate};

// All balls at each angle, and at the end once more where C began: there they tell where the plate is.
constexpr Poses kOnPlate{.count = [](const ProcedureOptions& options,
                                     const LoopState&) { return (std::size_t{options.angles} + 1) * options.balls; },
                         .at =
                             [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
                               const std::size_t stop = index / options.balls;
                               return Pose{{0, 0, stop < options.angles ? angleOfC(options, 0, stop) : 0},
                                           static_cast<std::uint16_t>(index % options.balls + 1)};
                             }};

std::optional<NotReady> whyNoSuchBall(const ProcedureOptions& options, const Facts& facts) {
  if (!facts.ball_plate) return std::nullopt;
  const std::size_t known = facts.ball_plate->balls_mm.size();
  if (options.balls <= known) return std::nullopt;
  return NotReady{Obstacle::option, "[ball_plate] of machine.toml has " + std::to_string(known) + " balls, but " +
                                        std::to_string(options.balls) +
                                        " are to be measured: describe the others, or measure fewer."};
}

// In Z; what the delay does to the top of a ball it does at every stop alike, and the plate's place takes it along.
double axialSigmaOf(const std::vector<Reading>& readings) {
  double sum = 0;
  for (const auto& reading : readings) sum += reading.centre.sd_mm.z() * reading.centre.sd_mm.z();
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// Tables first, second and third, and the keys: all balls at each station of C, the last one being the first again.
// Angles are relative to the first station.
void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts) {
  double balls = 0;
  for (const auto& reading : readings) balls = std::max(balls, reading.ball);
  const auto a_stop = static_cast<std::size_t>(balls);
  const double zero_rad = readings.back().c_rad;
  auto first = metrology::Table::withColumns("first", kPlateColumns);
  auto second = metrology::Table::withColumns("second", std::span{kPlateColumns}.last<4>());
  auto third = metrology::Table::withColumns("third", std::span{kPlateColumns}.last<4>());
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto& reading = readings[k];
    const auto& at = reading.centre.centre_mm;
    if (k + a_stop >= readings.size()) {
      second.append({reading.ball, at.x(), at.y(), at.z()});
    } else {
      // One stop is one angle, however finely the machine reads it.
      const double phi_rad = readings[k / a_stop * a_stop].c_rad - zero_rad;
      first.append({phi_rad, reading.ball, at.x(), at.y(), at.z()});
    }
  }
  for (std::size_t k = 0; k < std::min(a_stop, plate.balls_mm.size()); ++k) {
    const auto& at = plate.balls_mm[k];
    third.append({static_cast<double>(k + 1), at[0], at[1], at[2]});
  }
  auto& config = dataset.config;
  config["axis"] = std::string{"C"};
  config["axis_point_mm"] = std::vector<double>{plate.axis_point_mm.begin(), plate.axis_point_mm.end()};
  config["axis_direction"] = std::vector<double>{0, 0, 1};
  config["sigma_mm"] = sigmaOf(readings);
  config["sigma_axial_mm"] = axialSigmaOf(readings);
  if (facts.sigma_c_rad > 0) config["sigma_angle_rad"] = facts.sigma_c_rad;
  if (plate.sd_mm) config["sigma_third_mm"] = *plate.sd_mm;
  dataset.tables.insert(dataset.tables.begin(), {first, second, third});
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

RunDataset byHead(const FinishedRun& run) {
  auto [built, holds] = holdDataset(run);
  const auto& head = run.facts.sensor_head;
  if (head && head->calibrated) {
    addBalls(built.dataset, holds, *head, *head->calibrated, run.facts);
    return std::move(built);
  }
  built.refusal = metrology::Refusal{"no-sensor-head",
                                     "no calibration of the sensor head is in force, so its readings cannot be "
                                     "converted: calibrate it first, accept it, and measure again"};
  return std::move(built);
}

}  // namespace

constinit const LiveMethod kRotaryAxisErrors{
    .number = 15,
    .solver = &metrology::kRotaryAxisErrors,
    .steps =
        "three balls (`--heights`) that C carries at 8 angles of it (`--angles`, `--arc`), and once more where C "
        "began; five touches each",
    .steps_by_head = "the same balls and stops; a hold each, with the sensor head in the place of the probe",
    .needs = kNeeds,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kOnPlate,
    .usual = with(readings(),
                  [](auto& options) {
                    options.arc_rad = kTurn_rad;
                    options.angles = 8;
                    options.balls = 3;
                  }),
    .fewest_balls = 3,
    .why_unfit = whyNoSuchBall,
    .dataset = [](const FinishedRun& run) {
      if (run.recording.touches().front().request.holds) return byHead(run);
      return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
        addPlate(dataset, found.readings, *of.facts.ball_plate, of.facts);
      });
    }};

}  // namespace probebox::procedure
