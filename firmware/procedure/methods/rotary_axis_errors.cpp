#include "firmware/metrology/rotary/rotary_axis_errors.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/hold_readings.hpp"
#include "firmware/procedure/dataset/stop_shifts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/methods/plate_poses.hpp"
#include "firmware/procedure/methods/plate_tables.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Fact kBallPlate{
    .place = "`[ball_plate]`",
    .known = [](const Facts& facts) { return facts.ball_plate.has_value(); },
    .missing = "the certified positions of the balls: give [ball_plate] and its balls in machine.toml."};
constexpr std::array kNeedsOfRotaryAxisErrors{&kBallPlate};

constexpr Fact kPointOfB{
    .place = "`[ball_plate] b_axis_point_mm`",
    .known = [](const Facts& facts) { return facts.ball_plate && facts.ball_plate->b_axis_point_mm.has_value(); },
    .missing = "a point of that axis: give [ball_plate] b_axis_point_mm in machine.toml."};
constexpr std::array kNeedsAboutB{&kTiltingTable, &kPointOfB};

bool isMultiple(double angle_rad, double of_rad) {
  return std::abs(std::remainder(angle_rad, of_rad)) < 1e-6;
}

// A turn by a multiple of the pitch brings every ball to where another one has been.
std::optional<NotReady> whyNotAtStations(const ProcedureOptions& options, const BallPlate& plate, const Facts& facts) {
  if (!plate.station_correction && options.stations == 0) return std::nullopt;
  const auto because = [](const std::string& why) {
    return NotReady{Obstacle::option, std::string{kRotaryAxisErrors.name()} + " by stations " + why};
  };
  const std::size_t balls = plate.balls_mm.size();
  const std::string count = std::to_string(balls), pitch = "360/" + count + " degrees";
  if (options.balls != balls)
    return because("reads all " + count + " balls of [ball_plate]: give --heights " + count + ".");
  if (options.axis == kAxisB) {
    const BFacts b = facts.tilting_table.value_or(BFacts{});
    const double pitch_rad = kTurn_rad / static_cast<double>(balls);
    const auto tilts = std::span{b.angles_rad}.first(b.count);
    if (std::ranges::all_of(tilts, [&](double tilt_rad) { return isMultiple(tilt_rad, pitch_rad); }))
      return std::nullopt;
    return because("tilts by multiples of " + pitch + ": change tilts_deg of [tilting_table] in machine.toml.");
  }
  const bool whole_turn = options.arc_rad == 0 || options.arc_rad > kTurn_rad - 1e-9;
  if (whole_turn && options.angles != 0 && balls % options.angles == 0) return std::nullopt;
  return because("turns by multiples of " + pitch + ": give --angles " + count + " or a divisor of it, and no --arc.");
}

// What [rotary_table] could not interpolate would be refused when the result is accepted, behind the run.
std::optional<NotReady> whyNotByHarmonics(const ProcedureOptions& options, const Facts& facts) {
  const bool about_b = options.axis == kAxisB;
  if (!facts.by_harmonics[about_b ? 1 : 2]) return std::nullopt;
  const auto tilts = facts.tilting_table.value_or(BFacts{});
  std::vector<double> rising_rad{tilts.angles_rad.begin(), tilts.angles_rad.begin() + tilts.count};
  std::ranges::sort(rising_rad);
  const bool whole_turn = options.arc_rad == 0 || options.arc_rad > kTurn_rad - 1e-9;
  const bool even = about_b ? areEvenOverTurn(rising_rad) : whole_turn && (options.angles == 0 || options.angles >= 3);
  if (even) return std::nullopt;
  return NotReady{Obstacle::option,
                  std::string{kRotaryAxisErrors.name()} +
                      ": [rotary_table] of machine.toml interpolates this axis by harmonics, which need three or more "
                      "angles, equally spaced over the whole turn: " +
                      (about_b ? "write between_b = \"linear\" there."
                               : "give --angles 3 or more and no --arc, or write between_c = \"linear\" there.")};
}

std::optional<NotReady> whyNoSuchBall(const ProcedureOptions& options, const Facts& facts) {
  if (auto why = whyNotByHarmonics(options, facts)) return why;
  if (!facts.ball_plate) return std::nullopt;
  const std::size_t known = facts.ball_plate->balls_mm.size();
  if (options.balls <= known) return whyNotAtStations(options, *facts.ball_plate, facts);
  return NotReady{Obstacle::option, "[ball_plate] of machine.toml has " + std::to_string(known) + " balls, but " +
                                        std::to_string(options.balls) +
                                        " are to be measured: describe the others, or measure fewer."};
}

Matrix3d matrixOf(const std::array<std::array<double, 3>, 3>& rows) {
  Matrix3d matrix;
  for (Index i = 0; i < 3; ++i) matrix.row(i) = vectorOf(rows[static_cast<std::size_t>(i)]).transpose();
  return matrix;
}

// Standard deviations of the three coordinates of a displacement due to the uncertainty of K.
Vector3d sdByMatrix(const Matrix3d& inverse, const Matrix3d& sd, const Vector3d& displacement) {
  const Vector3d of_sensors = (sd.cwiseAbs2() * displacement.cwiseAbs2()).cwiseSqrt();
  return (inverse.cwiseAbs2() * of_sensors.cwiseAbs2()).cwiseSqrt();
}

void addPlateOfRun(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  addPlate(dataset, found.readings, *run.facts.ball_plate, run.facts);
}

// An error of K displaces all readings equally as far as the ball is at the same place in the head: that part is common
// to all of them, the rest differs for each. Returns warnings.
std::vector<std::string> addBalls(metrology::Dataset& dataset, const std::vector<Hold>& holds, const SensorHead& head,
                                  const CalibratedHead& calibrated, const FinishedRun& run) {
  const Matrix3d inverse = metrology::inverse(matrixOf(calibrated.matrix)), sd = matrixOf(calibrated.sd);
  Vector3d usual = Vector3d::Zero();
  for (const auto& hold : holds) usual += inverse * hold.sensors / static_cast<double>(holds.size());
  BallReadings found;
  for (const auto& hold : holds) {
    const auto& request = *hold.request;
    const Vector3d u = inverse * hold.sensors;
    const Vector3d variance = hold.sd_at_mm.cwiseAbs2() + inverse.cwiseAbs2() * hold.sd_sensors.cwiseAbs2() +
                              sdByMatrix(inverse, sd, u - usual).cwiseAbs2();
    found.readings.push_back({.number = static_cast<double>(request.reading),
                              .ball = static_cast<double>(request.ball),
                              .a_rad = request.rotary_angles_rad[0],
                              .b_rad = request.rotary_angles_rad[1],
                              .c_rad = request.rotary_angles_rad[2],
                              .tool = request.tool,
                              .mount = request.mount,
                              .note = request.note,
                              .centre = {.centre_mm = hold.at_mm + vectorOf(head.centre_offset_mm) + u,
                                         .sd_mm = variance.cwiseSqrt(),
                                         .radius_mm = 0}});
  }
  addPlateOfRun(dataset, found, run);
  auto& config = dataset.config;
  const double of_matrix_mm = sdByMatrix(inverse, sd, usual).norm() / std::sqrt(3.0);
  config["sigma_offset_mm"] = std::hypot(head.sd_centre_offset_mm, of_matrix_mm);
  config["tool_vector_mm"] = std::vector<double>{head.centre_offset_mm.begin(), head.centre_offset_mm.end()};
  metrology::Matrix matrix;
  for (const auto& row : calibrated.matrix) matrix.emplace_back(row.begin(), row.end());
  config["sensor_matrix"] = matrix;
  config["sensor_head_result"] = static_cast<double>(calibrated.result_id);
  return addStopShifts(dataset, found, run, addPlateOfRun);
}

RunDataset byHead(const FinishedRun& run) {
  auto [built, holds] = holdDataset(run);
  const auto& head = run.facts.sensor_head;
  if (head && head->calibrated) {
    built.warnings = addBalls(built.dataset, holds, *head, *head->calibrated, run);
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
    .why_no_y =
        "reads balls around the turning axis in X, Y and Z, and this machine has no Y: centreline-x "
        "finds X of the axis, and its slope over Z.",
    .steps =
        "three balls (`--heights`) that C carries at 8 angles of it (`--angles`, `--arc`), and once more where C "
        "began; five touches each",
    .steps_by_head = "the same balls and stops; a hold each, with the sensor head in the place of the probe",
    .steps_about_b =
        "the same balls at every tilt of the table with C at zero, and once more level; five touches each, four where "
        "a ball's stem has tilted into a side; also with `--head`",
    .needs = kNeedsOfRotaryAxisErrors,
    .needs_about_b = kNeedsAboutB,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kOnPlate,
    .usual = with(readings(),
                  [](auto& options) {
                    options.arc_rad = kTurn_rad;
                    options.angles = 8;
                    options.balls = 3;
                    options.b_count = 2;
                    options.b_angles_rad = {-kTurn_rad / 4, 0};
                    options.b_axis = {1, 0, 0};
                    options.mounts = 1;
                  }),
    .of_plate = true,
    .fewest_balls = 3,
    .also_refused = whyNoPlate,
    .described = [](ProcedureOptions options, const Facts& facts) -> Outcome<ProcedureOptions> {
      if (options.axis == kAxisB && facts.tilting_table) takeB(options, *facts.tilting_table);
      return options;
    },
    .why_unfit = whyNoSuchBall,
    .dataset = [](const FinishedRun& run) -> RunDataset {
      if (auto refusal = whyMountsDiffer(run.recording)) return RunDataset{touchesOf(run), std::move(refusal), {}};
      if (run.recording.touches().front().request.holds) return byHead(run);
      return ballDataset(run, addPlateOfRun);
    }};

}  // namespace probebox::procedure
