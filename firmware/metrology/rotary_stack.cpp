#include "firmware/metrology/rotary_stack.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/rigid.hpp"
#include "firmware/metrology/rotary_location.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 7> kKeys{"axis",           "axis_point_mm",      "axis_direction",   "sigma_mm",
                                                "sigma_third_mm", "station_correction", "station_radius_mm"};
constexpr double kWorstResidual = 5.0;   // sigma, between second and third
constexpr double kResidualFloor = 1e-5;  // mm; what the digits of a case file may round away
constexpr double kStationRadius = 30.0;  // mm
constexpr double kDegrees = 180.0 / std::numbers::pi;

// One coordinate reading of a ball, from the axis point.
struct BallReading3 {
  std::size_t mount{};
  std::size_t ball{};
  Vector3d at;
  std::optional<std::size_t> angle;    // of first; nothing in second
  std::optional<std::size_t> station;  // index of the reading of second that stands there
};

struct Stack {
  std::vector<double> angles;
  std::vector<Vector3d> certified;
  std::vector<RigidMotion> mounts;     // where the second coordinates put the plate
  std::vector<BallReading3> readings;  // second, then first
  std::size_t second_count{};
};

Matrix3d turned(const Vector3d& rotation) {
  const double angle = rotation.norm();
  return angle == 0.0 ? Matrix3d::Identity() : Eigen::AngleAxisd{angle, rotation / angle}.toRotationMatrix();
}

struct Keys {
  NominalAxis axis;
  Sigma sigma;
  double third_sigma{};  // mm; 0: the certificate is taken as it is
  std::optional<double> station_radius;
};

Outcome<Keys, Refusal> keysOf(const Dataset& dataset) {
  const auto axis = nominalAxis(dataset);
  if (!axis) return axis.error();
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const auto third = configPositive(dataset, "sigma_third_mm");
  if (!third) return third.error();
  if (third.value() && !sigma->stated) {
    return Refusal{"missing-key", "sigma_third_mm needs sigma_mm beside it: which of the two weighs more?"};
  }
  if (third.value() && dataset.config.contains("sd_certificate_mm")) {
    return Refusal{"bad-config",
                   "sigma_third_mm and sd_certificate_mm both say how uncertain the certificate is, which would count "
                   "twice: keep one of the two"};
  }
  const auto correct = configSwitch(dataset, "station_correction");
  if (!correct) return correct.error();
  const auto radius = configPositive(dataset, "station_radius_mm");
  if (!radius) return radius.error();
  Keys keys{axis.value(), sigma.value(), third->value_or(0.0), std::nullopt};
  if (correct.value()) keys.station_radius = radius->value_or(kStationRadius);
  return keys;
}

struct Tables {
  const Table* first{};
  const Table* second{};
  const Table* third{};
  bool mounts{};
};

Outcome<Tables, Refusal> tablesOf(const Dataset& dataset) {
  std::vector<std::string_view> ball{"ball", "x_mm", "y_mm", "z_mm"};
  const auto third = checkedTable(dataset, "third", ball);
  if (!third) return third.error();
  const Table* first = dataset.table("first");
  const bool mounts = first && first->column("mount");
  if (mounts) ball.emplace_back("mount");
  const auto second = checkedTable(dataset, "second", ball);
  if (!second) return second.error();
  ball.emplace_back("phi_rad");
  const auto checked = checkedTable(dataset, "first", ball);
  if (!checked) return checked.error();
  return Tables{checked.value(), second.value(), third.value(), mounts};
}

Vector3d placeOf(const Table& table, std::size_t row) {
  return {(*table.column("x_mm"))[row], (*table.column("y_mm"))[row], (*table.column("z_mm"))[row]};
}

// Reads the tables and puts the plate where the second coordinates have it, mount by mount.
class StackReader {
 public:
  StackReader(const Tables& tables, const NominalAxis& axis) : tables_{tables}, axis_{axis} {}

  Outcome<Stack, Refusal> read() {
    if (auto refusal = readThird()) return *refusal;
    if (auto refusal = readSecond()) return *refusal;
    if (auto refusal = place()) return *refusal;
    if (auto refusal = readFirst()) return *refusal;
    return std::move(stack_);
  }

 private:
  std::optional<Refusal> readThird() {
    for (std::size_t row = 0; row < tables_.third->rows(); ++row) {
      const double name = (*tables_.third->column("ball"))[row];
      if (!balls_.try_emplace(name, stack_.certified.size()).second) return twice(name, "third");
      stack_.certified.push_back(placeOf(*tables_.third, row));
    }
    return std::nullopt;
  }

  std::optional<Refusal> readSecond() {
    for (std::size_t row = 0; row < tables_.second->rows(); ++row) {
      const auto ball = ballOf(*tables_.second, row);
      if (!ball) return ball.error();
      const double name = mountName(*tables_.second, row);
      const auto mount = mounts_.try_emplace(name, mounts_.size()).first->second;
      for (const auto& other : stack_.readings) {
        if (other.mount == mount && other.ball == *ball) return twice((*tables_.second->column("ball"))[row], "second");
      }
      stack_.readings.push_back({mount, *ball, placeOf(*tables_.second, row) - axis_.point, {}, {}});
    }
    stack_.second_count = stack_.readings.size();
    return std::nullopt;
  }

  std::optional<Refusal> place() {
    for (const auto& [name, mount] : mounts_) {
      std::vector<Vector3d> from;
      std::vector<Vector3d> to;
      for (const auto& reading : stack_.readings) {
        if (reading.mount != mount) continue;
        from.push_back(stack_.certified[reading.ball]);
        to.push_back(reading.at);
      }
      Eigen::MatrixX3d from_rows{static_cast<Index>(from.size()), 3};
      Eigen::MatrixX3d to_rows{static_cast<Index>(to.size()), 3};
      for (std::size_t k = 0; k < from.size(); ++k) {
        from_rows.row(static_cast<Index>(k)) = from[k].transpose();
        to_rows.row(static_cast<Index>(k)) = to[k].transpose();
      }
      const auto motion = registerRigid(from_rows, to_rows);
      if (!motion) {
        return Refusal{motion.error().name, "table 'second', mount " + text(name) + ": " + motion.error().reason};
      }
      stack_.mounts.resize(mounts_.size());
      stack_.mounts[mount] = motion.value();
    }
    return std::nullopt;
  }

  std::optional<Refusal> readFirst() {
    const Table& first = *tables_.first;
    stack_.angles = distinctAngles(*first.column("phi_rad"));
    for (std::size_t row = 0; row < first.rows(); ++row) {
      const auto ball = ballOf(first, row);
      if (!ball) return ball.error();
      const auto mount = mounts_.find(mountName(first, row));
      if (mount == mounts_.end()) {
        return Refusal{"missing-ball", "table 'first', row " + std::to_string(row + 1) + ": mount " +
                                           text(mountName(first, row)) +
                                           " is not in table 'second': read the plate there with the axis at zero"};
      }
      const double phi = (*first.column("phi_rad"))[row];
      const auto angle = std::ranges::lower_bound(stack_.angles, phi - kSameRotaryAngle) - stack_.angles.begin();
      stack_.readings.push_back(
          {mount->second, *ball, placeOf(first, row) - axis_.point, static_cast<std::size_t>(angle), {}});
    }
    return std::nullopt;
  }

  double mountName(const Table& table, std::size_t row) const {
    return tables_.mounts ? (*table.column("mount"))[row] : 1.0;
  }
  static Refusal twice(double ball, const char* table) {
    return {"duplicated-ball",
            "table '" + std::string{table} + "' has ball " + text(ball) + " twice: give every ball once a mount"};
  }
  Outcome<std::size_t, Refusal> ballOf(const Table& table, std::size_t row) const {
    const double name = (*table.column("ball"))[row];
    const auto ball = balls_.find(name);
    if (ball != balls_.end()) return ball->second;
    return Refusal{"missing-ball", "ball " + text(name) + " of table '" + table.name +
                                       "' is not in table 'third': give its certified coordinates, or leave it out"};
  }

  Tables tables_;
  NominalAxis axis_;
  Stack stack_;
  std::map<double, std::size_t> balls_;
  std::map<double, std::size_t> mounts_;
};

Vector3d idealOf(const Stack& stack, const BallReading3& reading, const NominalAxis& axis) {
  const Vector3d place = stack.mounts[reading.mount](stack.certified[reading.ball]);
  if (!reading.angle) return place;
  return Eigen::AngleAxisd{stack.angles[*reading.angle], axis.direction} * place;
}

// Which reading of second stands where the axis has brought each ball.
std::optional<Refusal> findStations(Stack& stack, const NominalAxis& axis, double radius) {
  for (std::size_t k = 0; k < stack.readings.size(); ++k) {
    BallReading3& reading = stack.readings[k];
    const Vector3d at = idealOf(stack, reading, axis);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < stack.second_count; ++j) {
      if (stack.readings[j].mount != reading.mount) continue;
      const double off = (idealOf(stack, stack.readings[j], axis) - at).norm();
      if (off < least) reading.station = j;
      least = std::min(least, off);
    }
    if (least <= radius) continue;
    return Refusal{"not-at-station", "row " + std::to_string(k - stack.second_count + 1) +
                                         " of table 'first' was read " + text(least) +
                                         " mm from any station: turn by multiples of the pitch, or leave "
                                         "station_correction out"};
  }
  return std::nullopt;
}

// The balls of each angle, all mounts together: one fixes three errors, two fix five, three off one line all six.
std::optional<Refusal> badRank(const Stack& stack, const NominalAxis& axis) {
  for (std::size_t k = 0; k < stack.angles.size(); ++k) {
    MatrixXd design{0, 6};
    for (const auto& reading : stack.readings) {
      if (reading.angle != k) continue;
      design.conservativeResize(design.rows() + 3, Eigen::NoChange);
      design.bottomRows<3>() = smallMotionRows(idealOf(stack, reading, axis));
    }
    if (design.rows() >= 6 && scaledCondition(design.transpose() * design) <= kConditionLimit) continue;
    return Refusal{"rank-too-small", "at " + text(stack.angles[k] * kDegrees) +
                                         " degrees the balls of all mounts do not fix six errors: read three that are "
                                         "not on one line, in one mount or in several"};
  }
  return std::nullopt;
}

// Where each kind of unknown stands among the parameters: places of the plate (6 a mount), errors (6 an angle), errors
// of the stations (3 a reading of second), the certificate (3 a ball).
class StackModel {
 public:
  StackModel(const Stack& stack, const Keys& keys) : stack_{stack}, keys_{keys} {
    errors_at_ = 6 * static_cast<Index>(stack.mounts.size());
    stations_at_ = errors_at_ + 6 * static_cast<Index>(stack.angles.size());
    balls_at_ = stations_at_ + (keys.station_radius ? 3 * static_cast<Index>(stack.second_count) : 0);
    size_ = balls_at_ + (keys.third_sigma > 0.0 ? 3 * static_cast<Index>(stack.certified.size()) : 0);
  }
  Index size() const { return size_; }
  Index errorsAt() const { return errors_at_; }

  Linearised operator()(const VectorXd& at) const {
    const auto readings = 3 * static_cast<Index>(stack_.readings.size());
    const Index gauge = keys_.station_radius ? 6 * static_cast<Index>(stack_.mounts.size()) : 0;
    const Index rows = readings + gauge + (size_ - balls_at_);
    Linearised model{VectorXd::Zero(rows), MatrixXd::Zero(rows, size_)};
    for (std::size_t k = 0; k < stack_.readings.size(); ++k) addReading(model, static_cast<Index>(3 * k), k, at);
    if (gauge > 0) addGauge(model, readings, at);
    for (Index k = balls_at_; k < size_; ++k) {  // the certificate holds its balls
      const Index row = readings + gauge + k - balls_at_;
      model.residuals[row] = at[k] / keys_.third_sigma;
      model.jacobian(row, k) = 1.0 / keys_.third_sigma;
    }
    return model;
  }

 private:
  void addReading(Linearised& model, Index row, std::size_t k, const VectorXd& at) const {
    const BallReading3& reading = stack_.readings[k];
    const auto mount = 6 * static_cast<Index>(reading.mount);
    const RigidMotion& start = stack_.mounts[reading.mount];
    const auto ball = balls_at_ + 3 * static_cast<Index>(reading.ball);
    Vector3d certified = stack_.certified[reading.ball];
    if (balls_at_ < size_) certified += at.segment<3>(ball);
    const Vector3d place = at.segment<3>(mount) + turned(at.segment<3>(mount + 3)) * start(certified);
    Matrix3d seen = Matrix3d::Identity();  // of the plate, after the axis has turned it
    Vector3d model_at = place;
    auto jacobian = model.jacobian.middleRows<3>(row);
    if (reading.angle) {
      seen = Eigen::AngleAxisd{stack_.angles[*reading.angle], keys_.axis.direction}.toRotationMatrix();
      const Vector3d ideal = seen * place;
      const Index errors = errors_at_ + 6 * static_cast<Index>(*reading.angle);
      model_at = at.segment<3>(errors) + turned(at.segment<3>(errors + 3)) * ideal;
      jacobian.middleCols<6>(errors) = smallMotionRows(ideal) / keys_.sigma.value;
    }
    jacobian.middleCols<6>(mount) = seen * smallMotionRows(place) / keys_.sigma.value;
    if (balls_at_ < size_) jacobian.middleCols<3>(ball) = seen * start.rotation / keys_.sigma.value;
    if (reading.station) {
      const Index station = stations_at_ + 3 * static_cast<Index>(*reading.station);
      model_at += at.segment<3>(station);
      jacobian.middleCols<3>(station) = Matrix3d::Identity() / keys_.sigma.value;
    }
    model.residuals.segment<3>(row) = (model_at - reading.at) / keys_.sigma.value;
  }

  // What the stations move by as one body is the plate's place: it is left out of their errors.
  void addGauge(Linearised& model, Index from, const VectorXd& at) const {
    for (std::size_t j = 0; j < stack_.second_count; ++j) {
      const auto& reading = stack_.readings[j];
      const Index row = from + 6 * static_cast<Index>(reading.mount);
      const Index station = stations_at_ + 3 * static_cast<Index>(j);
      Eigen::Matrix<double, 3, 6> rigid = smallMotionRows(idealOf(stack_, reading, keys_.axis));
      rigid.rightCols<3>() /= 100.0;  // mm: like the translations
      model.jacobian.block<6, 3>(row, station) += rigid.transpose() / keys_.sigma.value;
      model.residuals.segment<6>(row) += rigid.transpose() * at.segment<3>(station) / keys_.sigma.value;
    }
  }

  const Stack& stack_;
  const Keys& keys_;
  Index errors_at_{};
  Index stations_at_{};
  Index balls_at_{};
  Index size_{};
};

// With errors of the stations the second coordinates agree with the certificate by construction.
std::optional<Refusal> badSecond(const Stack& stack, const Fit& fit, const Keys& keys) {
  if (!keys.sigma.stated || keys.station_radius) return std::nullopt;
  const auto rows = 3 * static_cast<Index>(stack.second_count);
  Index worst = 0;
  const double off = fit.residuals.head(rows).cwiseAbs().maxCoeff(&worst) * keys.sigma.value;
  if (off <= std::max(kWorstResidual * keys.sigma.value, kResidualFloor)) return std::nullopt;
  return Refusal{"residual-too-large", "row " + std::to_string(worst / 3 + 1) + " of table 'second' is " + text(off) +
                                           " mm off, more than 5 sigma: measure it again"};
}

// Read minus fitted, one a coordinate.
Residuals residualsOf(const Stack& stack, const Fit& fit, double sigma) {
  Residuals residuals{.unit = "mm", .against = "phi_rad", .names = {}, .at = {}, .values = {}};
  for (std::size_t k = 0; k < 3 * stack.readings.size(); ++k) {
    const BallReading3& reading = stack.readings[k / 3];
    const double angle = reading.angle ? stack.angles[*reading.angle] : 0.0;
    residuals.names.push_back((reading.angle ? "first, " + text(angle * kDegrees) + " degrees" : "second") +
                              ", mount " + std::to_string(reading.mount + 1) + ", ball " +
                              std::to_string(reading.ball + 1) + ", " + "xyz"[k % 3] + "_mm");
    residuals.at.push_back(angle);
    residuals.values.push_back(-fit.residuals[static_cast<Index>(k)] * sigma);
  }
  return residuals;
}

}  // namespace

Outcome<Result, Refusal> solveRotaryStack(const Dataset& dataset) {
  const auto keys = keysOf(dataset);
  if (!keys) return keys.error();
  const auto tables = tablesOf(dataset);
  if (!tables) return tables.error();
  auto stack = StackReader{tables.value(), keys->axis}.read();
  if (!stack) return stack.error();
  if (auto refusal = badRank(stack.value(), keys->axis)) return *refusal;
  if (keys->station_radius) {
    if (auto refusal = findStations(stack.value(), keys->axis, *keys->station_radius)) return *refusal;
  }
  const StackModel model{stack.value(), keys.value()};
  const auto fit = leastSquares(model, VectorXd::Zero(model.size()));
  if (!fit) return fit.error();
  if (auto refusal = badSecond(stack.value(), fit.value(), keys.value())) return *refusal;

  Answer answer{dataset, fit.value(), keys->sigma};
  const auto count = 6 * static_cast<Index>(stack->angles.size());
  const VectorXd six = fit->parameters.segment(model.errorsAt(), count);
  const MatrixXd rows = pick(model.errorsAt(), count, model.size());
  answer.result().residuals = residualsOf(stack.value(), fit.value(), keys->sigma.value);
  answer.readingRows(3 * static_cast<Index>(stack->readings.size()));
  promiseErrors(answer, stack->angles, six, rows, keys->axis.direction);
  addNominalAxis(answer.result(), keys->axis);
  for (auto& warning : unusedKeys(dataset, kKeys)) answer.warn(std::move(warning));
  return std::move(answer).take(true);
}

}  // namespace probebox::metrology
