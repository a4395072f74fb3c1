#include "firmware/metrology/rotary/sensor_head.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/further_reading.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kBallOfReading{
    .key = "ball_mm", .about = "centre of the ball, a row a reading", .compared = Compared::never};

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kNest_mm = 20.0;  // a ball inside the nest of a head moves less
constexpr MethodColumn kSensor1{"s1", ColumnRole::deflection}, kSensor2{"s2", ColumnRole::deflection},
    kSensor3{"s3", ColumnRole::deflection};
constexpr MethodColumn kMoveColumns[]{column::given("ux_mm", kNest_mm),
                                      column::given("uy_mm", kNest_mm),
                                      column::given("uz_mm", kNest_mm),
                                      kSensor1,
                                      kSensor2,
                                      kSensor3};
constexpr MethodColumn kReadingColumns[]{column::kX, column::kY, column::kZ, kSensor1, kSensor2, kSensor3};
constexpr double kWorstHead = 50.0;  // condition of K
constexpr double kLeastMove = 5.0;   // of a sensor's noise
constexpr double kReach = 1.5;       // of the largest move: sensors may not be linear beyond
constexpr Index kParameters = 12;    // K row by row, each followed by its zero

Outcome<Fit, Refusal> fitHead(const MatrixXd& moves, double sigma) {
  const Index rows = 3 * moves.rows();
  MatrixXd design = MatrixXd::Zero(rows, kParameters);
  Eigen::VectorXd values{rows};
  for (Index i = 0; i < moves.rows(); ++i) {
    for (Index sensor = 0; sensor < 3; ++sensor) {
      design.row(3 * i + sensor).segment(4 * sensor, 4) << moves.row(i).head(3), 1.0;
      values[3 * i + sensor] = moves(i, 3 + sensor);
    }
  }
  auto fit = linearLeastSquares(design / sigma, values / sigma);
  if (fit || fit.error().name != "ill-conditioned") return fit;
  return Refusal{"dependent-directions", "the moves do not span three dimensions: move the machine along X, Y and Z"};
}

// noise: of one sensor.
std::optional<Refusal> badHead(const Matrix3d& matrix, const MatrixXd& moves, double noise) {
  const Vector3d spans = (moves.leftCols(3).colwise().maxCoeff() - moves.leftCols(3).colwise().minCoeff()).transpose();
  for (Index axis = 0; axis < 3; ++axis) {
    const double seen = spans[axis] * matrix.col(axis).norm();
    if (seen >= kLeastMove * noise) continue;
    return Refusal{"moves-too-small", "the moves along " + std::string(1, "XYZ"[axis]) + " change the sensors by " +
                                          text(seen) + ", less than five times their noise: move further"};
  }
  const Vector3d widths = singularValues(matrix);
  if (!(widths[0] <= kWorstHead * widths[2])) {
    return Refusal{"sensors-dependent",
                   "the sensors measure in nearly the same direction: the condition number of their matrix is " +
                       text(widths[0] / widths[2]) + ", more than 50; mount them at larger angles to each other"};
  }
  return std::nullopt;
}

// Rows of d displacement / d parameters.
MatrixXd displacementSlopes(const Matrix3d& inverse, const Vector3d& displacement) {
  MatrixXd slopes{3, kParameters};
  for (Index sensor = 0; sensor < 3; ++sensor) {
    slopes.middleCols(4 * sensor, 4) =
        -inverse.col(sensor) * Eigen::RowVector4d{displacement[0], displacement[1], displacement[2], 1.0};
  }
  return slopes;
}

struct ReadBalls {
  Eigen::VectorXd values;
  MatrixXd slopes;
};

ReadBalls readBalls(const Table& table, const SensorHead& head, const Vector3d& tool) {
  const MatrixXd readings = columnsOf(table, kReadingColumns);
  const Matrix3d inverted = inverse(head.matrix);
  ReadBalls balls{Eigen::VectorXd{3 * readings.rows()}, MatrixXd{3 * readings.rows(), kParameters}};
  for (Index i = 0; i < readings.rows(); ++i) {
    const Vector3d sensors = readings.row(i).tail<3>().transpose();
    balls.values.segment<3>(3 * i) = head.ball(readings.row(i).head<3>().transpose(), tool, sensors);
    balls.slopes.middleRows<3>(3 * i) = displacementSlopes(inverted, head.displacement(sensors));
  }
  return balls;
}

// The reading that is furthest from the head's reference, where it is further than the moves.
struct Beyond {
  std::string what;
  bool implausible{};
};

std::optional<Beyond> beyondMoves(const Table& readings, const SensorHead& head, const MatrixXd& moves) {
  const MatrixXd sensors = columnsOf(readings, std::span{kReadingColumns}.last(3));
  const Eigen::VectorXd away =
      (inverse(head.matrix) * (sensors.rowwise() - head.zero.transpose()).transpose()).colwise().norm();
  Index row = 0;
  const double farthest_mm = away.maxCoeff(&row);
  const double moved_mm = moves.leftCols(3).rowwise().norm().maxCoeff();
  if (farthest_mm <= kReach * moved_mm && farthest_mm <= kNest_mm) return std::nullopt;
  return Beyond{"table 'readings', row " + std::to_string(row + 1) + ": by its sensors the ball is " +
                    text(farthest_mm) + " mm from the head's reference, and the moves reach " + text(moved_mm) + " mm",
                farthest_mm > kNest_mm};
}

// The noise of every reading comes on top of that of the calibration. seen: of a ball, per unit sigma of three sensors.
void addReadingNoise(Result& result, const Matrix3d& seen) {
  auto& sd = result.estimates.back().sd;
  const Matrix3d own = seen * seen.transpose();
  for (std::size_t k = 0; k < sd.size(); ++k) {
    const auto axis = static_cast<Index>(k % 3);
    sd[k] = std::sqrt(sd[k] * sd[k] + own(axis, axis));
  }
  const auto size = result.covariance ? static_cast<Index>(result.covariance->components.size()) : 0;
  Eigen::Map<MatrixXd> covariance{size > 0 ? result.covariance->values.data() : nullptr, size, size};
  for (Index ball = kParameters; ball < size; ball += 3) covariance.block<3, 3>(ball, ball) += own;
}

}  // namespace

Vector3d SensorHead::displacement(const Vector3d& sensors) const {
  return inverse(matrix) * (sensors - zero);
}

Vector3d SensorHead::ball(const Vector3d& machine, const Vector3d& tool, const Vector3d& sensors) const {
  return machine + tool + displacement(sensors);
}

Outcome<Result, Refusal> solveSensorHeadCalibration(const Dataset& dataset) {
  TRY(const auto sigma, configSigma(dataset, "sigma_sensor"));
  TRY(const auto tool, configVector(dataset, "tool_vector_mm"));
  TRY(const auto reference, configVector(dataset, "reference_mm"));
  TRY(const auto table, checkedTable(dataset, "moves", kMoveColumns));
  const MatrixXd moves = columnsOf(*table, kMoveColumns);
  TRY(const auto fit, fitHead(moves, sigma.value));
  SensorHead head;
  MatrixXd pick_matrix = MatrixXd::Zero(9, kParameters);
  MatrixXd pick_zero = MatrixXd::Zero(3, kParameters);
  for (Index sensor = 0; sensor < 3; ++sensor) {
    head.matrix.row(sensor) = fit.parameters.segment<3>(4 * sensor).transpose();
    head.zero[sensor] = fit.parameters[4 * sensor + 3];
    pick_matrix.block<3, 3>(3 * sensor, 4 * sensor).setIdentity();
    pick_zero(sensor, 4 * sensor + 3) = 1.0;
  }
  Answer answer{dataset, fit, sigma};
  answer.readingIs("one sensor", "units of the sensors");
  if (auto refusal = badHead(head.matrix, moves, answer.readingSd().value_or(0.0))) return *refusal;
  const double noise = sdOfFurtherReading(answer, fit, sigma).value_or(0.0);
  answer.promiseMatrix(quantity::kSensorMatrix, 3, pick_matrix * fit.parameters, pick_matrix);
  answer.promiseVector(quantity::kSensorZero, head.zero, pick_zero);
  const Vector3d sensitivity = head.matrix.rowwise().norm();
  answer.result().also.push_back(Estimate::vector("sensitivity", {sensitivity.begin(), sensitivity.end()}, {}));
  if (reference) {
    // Where the sensors all read zero the ball is away from the reference by -K^-1 zero.
    const Matrix3d inverted = inverse(head.matrix);
    const Vector3d centre = inverted * head.zero;
    const Vector3d at = Vector3d{reference->data()} + centre;
    answer.alsoVector("centred_mm", at, -displacementSlopes(inverted, -centre));
  }
  if (dataset.table("readings")) {
    TRY(const auto readings, checkedTable(dataset, "readings", kReadingColumns));
    const Vector3d vector = tool ? Vector3d{tool->data()} : Vector3d{Vector3d::Zero()};
    if (const auto beyond = beyondMoves(*readings, head, moves)) {
      if (beyond->implausible) return Refusal{"implausible", beyond->what + "; leave the reading out or read it again"};
      answer.warn(beyond->what + "; beyond 1.5 times that the matrix is extrapolated: read nearer, or move further");
    }
    const ReadBalls balls = readBalls(*readings, head, vector);
    answer.promiseMatrix(kBallOfReading, 3, balls.values, balls.slopes);
  }
  for (auto& warning : equalRows(*table)) answer.warn(std::move(warning));
  answer.result().convention =
      "sensors = zero + matrix * position of the ball relative to the head's reference; rms in the unit of the sensors";
  answer.readings(*table, std::span{kMoveColumns}.last(3), kMoveColumns[0]);
  Result result = std::move(answer).take(true);
  if (dataset.table("readings")) addReadingNoise(result, inverse(head.matrix) * noise);
  return result;
}

namespace {

constexpr MethodTable kSensorHeadTables[]{
    {"moves", kMoveColumns, "position of the ball relative to the head's reference, and the readings of the sensors",
     true},
    {"readings", kReadingColumns, "optional: machine position, and the readings of the sensors"}};
constexpr MethodKey kSensorHeadKeys[]{
    {"sigma_sensor", "", "standard deviation of one sensor (k = 1), in its unit"},
    {"tool_vector_mm", "[0,0,0]", "from the machine's position to the head's reference"},
    {"reference_mm", "", "the machine's position at the reference, u = 0; gives centred_mm"},
    {"tool", "", "number of the sensor head as a tool; needed by the box"}};
constexpr Quantity kSensorHeadResults[]{quantity::kSensorMatrix, quantity::kSensorZero, kBallOfReading};
constexpr std::string_view kSensorHeadUnobservable[]{
    "the position of the ball separately from that of the head's reference: only moves relative to it"};

std::optional<Subject> subjectOfHead(const Dataset& dataset) {
  return numberedSubject(dataset, SubjectKind::sensor_head, "tool");
}

}  // namespace

const Method kSensorHeadCalibration{.name = "sensor-head-calibration",
                                    .title = "Calibration of a sensor head",
                                    .equations = "(E1)",
                                    .source = source::kRotary,
                                    .solver = solveSensorHeadCalibration,
                                    .tables = kSensorHeadTables,
                                    .keys = kSensorHeadKeys,
                                    .results = kSensorHeadResults,
                                    .unobservable = kSensorHeadUnobservable,
                                    .subject = {.of = subjectOfHead}};

}  // namespace probebox::metrology
