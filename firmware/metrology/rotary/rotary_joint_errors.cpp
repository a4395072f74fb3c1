#include "firmware/metrology/rotary/rotary_joint_errors.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/block_least_squares.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/rotary/rotary_location.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

// Position of a measured ball relative to the axis point.
struct PlateReading {
  std::size_t mount{};
  std::size_t ball{};
  Eigen::Vector3d at;
  std::optional<std::size_t> angle;    // of first; nothing in second
  std::optional<std::size_t> station;  // index of the reading of second at this station
};

struct PlateReadings {
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> certified;
  std::vector<RigidMotion> mounts;     // where the second coordinates put the plate
  std::vector<PlateReading> readings;  // second, then first
  std::size_t second_count{};
};

using Eigen::Index;
using Eigen::Vector3d;

struct Tables {
  const Table* first{};
  const Table* second{};
  const Table* third{};
  bool mounts{};
};

Outcome<Tables, Refusal> tablesOf(const Dataset& dataset) {
  std::vector<std::string_view> ball{column::kBall, column::kX, column::kY, column::kZ};
  TRY(const auto third, checkedTable(dataset, "third", ball));
  const Table* first = dataset.table("first");
  const bool mounts = first && first->column(kMount);
  if (mounts) ball.emplace_back(kMount);
  TRY(const auto second, checkedTable(dataset, "second", ball));
  ball.emplace_back(column::kPhi);
  TRY(const auto checked, checkedTable(dataset, "first", ball));
  return Tables{checked, second, third, mounts};
}

Vector3d placeOf(const Table& table, std::size_t row) {
  return {(*table.column(column::kX))[row], (*table.column(column::kY))[row], (*table.column(column::kZ))[row]};
}

// Reads the tables and puts the plate where the second coordinates have it, mount by mount.
class PlateReader {
 public:
  PlateReader(const Tables& tables, const NominalAxis& axis) : tables_{tables}, axis_{axis} {}

  Outcome<PlateReadings, Refusal> read() {
    if (auto refusal = readThird()) return *refusal;
    if (auto refusal = readSecond()) return *refusal;
    if (auto refusal = place()) return *refusal;
    if (auto refusal = readFirst()) return *refusal;
    return std::move(stack_);
  }

 private:
  std::optional<Refusal> readThird() {
    for (std::size_t row = 0; row < tables_.third->rows(); ++row) {
      const double name = (*tables_.third->column(column::kBall))[row];
      if (!balls_.try_emplace(name, stack_.certified.size()).second) return twice(name, "third");
      stack_.certified.push_back(placeOf(*tables_.third, row));
    }
    return std::nullopt;
  }

  std::optional<Refusal> readSecond() {
    for (std::size_t row = 0; row < tables_.second->rows(); ++row) {
      TRY(const auto ball, ballOf(*tables_.second, row));
      const double name = mountName(*tables_.second, row);
      const auto mount = mounts_.try_emplace(name, mounts_.size()).first->second;
      for (const auto& other : stack_.readings) {
        if (other.mount == mount && other.ball == ball)
          return twice((*tables_.second->column(column::kBall))[row], "second");
      }
      stack_.readings.push_back({mount, ball, placeOf(*tables_.second, row) - axis_.point, {}, {}});
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
    stack_.angles = distinctAngles(*first.column(column::kPhi));
    for (std::size_t row = 0; row < first.rows(); ++row) {
      TRY(const auto ball, ballOf(first, row));
      const auto mount = mounts_.find(mountName(first, row));
      if (mount == mounts_.end()) {
        return Refusal{"missing-ball", "table 'first', row " + std::to_string(row + 1) + ": mount " +
                                           text(mountName(first, row)) +
                                           " is not in table 'second': read the plate there with the axis at zero"};
      }
      const double phi = (*first.column(column::kPhi))[row];
      const auto angle = std::ranges::lower_bound(stack_.angles, phi - kSameTableAngle_rad) - stack_.angles.begin();
      stack_.readings.push_back(
          {mount->second, ball, placeOf(first, row) - axis_.point, static_cast<std::size_t>(angle), {}});
    }
    return std::nullopt;
  }

  double mountName(const Table& table, std::size_t row) const {
    return tables_.mounts ? (*table.column(kMount))[row] : 1.0;
  }
  static Refusal twice(double ball, const char* table) {
    return {"duplicated-ball",
            "table '" + std::string{table} + "' has ball " + text(ball) + " twice: give every ball once a mount"};
  }
  Outcome<std::size_t, Refusal> ballOf(const Table& table, std::size_t row) const {
    const double name = (*table.column(column::kBall))[row];
    const auto ball = balls_.find(name);
    if (ball != balls_.end()) return ball->second;
    return Refusal{"missing-ball", "ball " + text(name) + " of table '" + table.name +
                                       "' is not in table 'third': give its certified coordinates, or omit it"};
  }

  Tables tables_;
  NominalAxis axis_;
  PlateReadings stack_;
  std::map<double, std::size_t> balls_;
  std::map<double, std::size_t> mounts_;
};

// Reads the tables first, second, third, with `mount` or without, and locates the plate by the second coordinates,
// mount by mount. Refuses: what checkedTable and registerRigid refuse, duplicated-ball, missing-ball.
Outcome<PlateReadings, Refusal> readPlates(const Dataset& dataset, const NominalAxis& axis) {
  TRY(const auto tables, tablesOf(dataset));
  return PlateReader{tables, axis}.read();
}

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kStationRadius = 30.0;  // mm
// sd of the condition on the stations, in sigma of a reading. It chooses among equivalent descriptions and measures
// nothing, so its sd must not reach the results: with 0.01 it adds 0.02 % to an sd, and the fit stays well conditioned.
constexpr double kGaugeSigma = 0.01;

Matrix3d turned(const Vector3d& rotation) {
  const double angle = rotation.norm();
  return angle == 0.0 ? Matrix3d::Identity() : Eigen::AngleAxisd{angle, rotation / angle}.toRotationMatrix();
}

struct Keys {
  NominalAxis axis;
  Sigma sigma;
  double axial_sigma{};   // mm; of a coordinate along the axis
  double angle_sigma{};   // rad, of every stop; 0: the axis stands where it says
  double third_sigma{};   // mm; 0: the certificate is taken as it is
  double offset_sigma{};  // mm, each coordinate, of what all readings share; 0: nothing
  std::optional<double> station_radius;
};

Outcome<Keys, Refusal> keysOf(const Dataset& dataset) {
  TRY(const auto axis, nominalAxis(dataset));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto third, configPositive(dataset, "sigma_third_mm"));
  TRY(const auto axial, configPositive(dataset, "sigma_axial_mm"));
  TRY(const auto angle, configPositive(dataset, "sigma_angle_rad"));
  TRY(const auto offset, configPositive(dataset, "sigma_offset_mm"));
  for (const char* key : kOtherSigmas) {
    if (dataset.config.contains(key) && !sigma.stated)
      return Refusal{"missing-key",
                     std::string{key} + " needs sigma_mm as well: without it the weights of the two are unknown"};
  }
  if (third && dataset.config.contains("sd_certificate_mm")) {
    return Refusal{"bad-config",
                   "sigma_third_mm and sd_certificate_mm both say how uncertain the certificate is, which would count "
                   "twice: keep one of the two"};
  }
  TRY(const auto correct, configSwitch(dataset, "station_correction"));
  TRY(const auto radius, configPositive(dataset, "station_radius_mm"));
  Keys keys{.axis = axis,
            .sigma = sigma,
            .axial_sigma = axial.value_or(sigma.value),
            .angle_sigma = angle.value_or(0.0),
            .third_sigma = third.value_or(0.0),
            .offset_sigma = offset.value_or(0.0),
            .station_radius = std::nullopt};
  if (correct) keys.station_radius = radius.value_or(kStationRadius);
  return keys;
}

Vector3d idealOf(const PlateReadings& stack, const PlateReading& reading, const NominalAxis& axis) {
  const Vector3d place = stack.mounts[reading.mount](stack.certified[reading.ball]);
  if (!reading.angle) return place;
  return Eigen::AngleAxisd{stack.angles[*reading.angle], axis.direction} * place;
}

// Which reading of second stands where the axis has brought each ball.
std::optional<Refusal> findStations(PlateReadings& stack, const NominalAxis& axis, double radius) {
  for (std::size_t k = 0; k < stack.readings.size(); ++k) {
    PlateReading& reading = stack.readings[k];
    const Vector3d at = idealOf(stack, reading, axis);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < stack.second_count; ++j) {
      if (stack.readings[j].mount != reading.mount) continue;
      const double off = (idealOf(stack, stack.readings[j], axis) - at).norm();
      if (off < least) reading.station = j;
      least = std::min(least, off);
    }
    if (least <= radius) continue;
    return Refusal{"not-at-station",
                   "row " + std::to_string(k - stack.second_count + 1) + " of table 'first' was read " + text(least) +
                       " mm from any station: turn by multiples of the pitch, or omit station_correction"};
  }
  return std::nullopt;
}

// The balls of each angle, all mounts together: one fixes three errors, two fix five, three off one line all six.
std::optional<Refusal> badRank(const PlateReadings& stack, const NominalAxis& axis) {
  for (std::size_t k = 0; k < stack.angles.size(); ++k) {
    MatrixXd design{0, 6};
    for (const auto& reading : stack.readings) {
      if (reading.angle != k) continue;
      design.conservativeResize(design.rows() + 3, Eigen::NoChange);
      design.bottomRows<3>() = smallMotionRows(idealOf(stack, reading, axis));
    }
    if (design.rows() >= 6 && scaledCondition(design.transpose() * design) <= kConditionLimit) continue;
    return Refusal{"rank-too-small", "at " + text(degrees(stack.angles[k])) +
                                         " degrees the balls of all mounts do not determine six errors: read three "
                                         "that are not on one line, in one mount or in several"};
  }
  return std::nullopt;
}

// One over the sigma of a coordinate: along the axis it may be another one than across.
Matrix3d weightOf(const Keys& keys) {
  const Vector3d& u = keys.axis.direction;
  const Matrix3d axial = u * u.transpose();
  return (Matrix3d::Identity() - axial) / keys.sigma.value + axial / keys.axial_sigma;
}

// Which unknowns there are, as blocks of a least squares. Common: places of the plate (6 a mount), errors of the
// stations (3 a reading of second), the certificate (3 a ball), how far off its zero the axis stopped for second (1 a
// mount), what all readings are off by (3). Of each angle: its errors (6), and how far off it the axis stopped (1 a
// mount, as it stops anew in each). Certificate, stops and offset are held by what is known of them.
class StackModel {
 public:
  StackModel(const PlateReadings& stack, const Keys& keys) : stack_{stack}, keys_{keys}, weight_{weightOf(keys)} {
    mounts_ = static_cast<Index>(stack.mounts.size());
    stations_at_ = 6 * mounts_;
    balls_at_ = stations_at_ + (keys.station_radius ? 3 * static_cast<Index>(stack.second_count) : 0);
    stops_at_ = balls_at_ + (keys.third_sigma > 0.0 ? 3 * static_cast<Index>(stack.certified.size()) : 0);
    offset_at_ = stops_at_ + (keys.angle_sigma > 0.0 ? mounts_ : 0);
    common_size_ = offset_at_ + (keys.offset_sigma > 0.0 ? 3 : 0);
    own_size_ = 6 + (keys.angle_sigma > 0.0 ? mounts_ : 0);
    readings_of_.resize(stack.angles.size() + 1);
    for (std::size_t k = 0; k < stack.readings.size(); ++k)
      readings_of_[stack.readings[k].angle.value_or(stack.angles.size())].push_back(k);
  }
  BlockUnknowns start() const {
    return {VectorXd::Zero(common_size_), std::vector(stack_.angles.size(), VectorXd{VectorXd::Zero(own_size_)})};
  }

  // Rows of one angle, or of second with those of what is known of the common unknowns.
  BlockRows operator()(std::size_t block, const BlockUnknowns& at) const {
    const bool is_second = block == stack_.angles.size();
    const auto readings = 3 * static_cast<Index>(readings_of_[block].size());
    const Index gauge = is_second && keys_.station_radius ? 6 * mounts_ : 0;
    const Index held = is_second ? common_size_ - balls_at_ : own_size_ - 6;
    const Index size = readings + gauge + held;
    BlockRows rows{VectorXd::Zero(size), MatrixXd::Zero(size, is_second ? 0 : own_size_),
                   MatrixXd::Zero(size, common_size_)};
    Index row = 0;
    for (const auto k : readings_of_[block]) {
      addReading(rows, row, stack_.readings[k], at.common, is_second ? VectorXd{} : at.own[block]);
      row += 3;
    }
    if (gauge > 0) addGauge(rows, readings, at.common);
    for (Index k = 0; k < held; ++k) {
      const Index common = balls_at_ + k;
      const double sigma = !is_second || (common >= stops_at_ && common < offset_at_) ? keys_.angle_sigma
                           : common < stops_at_                                       ? keys_.third_sigma
                                                                                      : keys_.offset_sigma;
      rows.residuals[readings + gauge + k] = (is_second ? at.common[common] : at.own[block][6 + k]) / sigma;
      (is_second ? rows.common(readings + gauge + k, common) : rows.own(readings + gauge + k, 6 + k)) = 1.0 / sigma;
    }
    return rows;
  }

  // All residuals: of the readings in their order, then the others.
  VectorXd residuals(const BlockUnknowns& at) const {
    std::vector<double> others;
    VectorXd of_readings{3 * static_cast<Index>(stack_.readings.size())};
    for (std::size_t block = 0; block < readings_of_.size(); ++block) {
      const VectorXd values = (*this)(block, at).residuals;
      Index row = 0;
      for (const auto k : readings_of_[block]) {
        of_readings.segment<3>(3 * static_cast<Index>(k)) = values.segment<3>(row);
        row += 3;
      }
      others.insert(others.end(), values.begin() + row, values.end());
    }
    VectorXd all{of_readings.size() + std::ssize(others)};
    all << of_readings, VectorXd::Map(others.data(), std::ssize(others));
    return all;
  }

 private:
  void addReading(BlockRows& rows, Index row, const PlateReading& reading, const VectorXd& common,
                  const VectorXd& own) const {
    const auto mount = 6 * static_cast<Index>(reading.mount);
    const RigidMotion& start = stack_.mounts[reading.mount];
    const auto ball = balls_at_ + 3 * static_cast<Index>(reading.ball);
    Vector3d certified = stack_.certified[reading.ball];
    if (balls_at_ < stops_at_) certified += common.segment<3>(ball);
    const Vector3d place = common.segment<3>(mount) + turned(common.segment<3>(mount + 3)) * start(certified);
    const auto of_mount = static_cast<Index>(reading.mount);
    double angle = reading.angle ? stack_.angles[*reading.angle] : 0.0;
    if (stops_at_ < offset_at_) angle += reading.angle ? own[6 + of_mount] : common[stops_at_ + of_mount];
    // Orientation of the plate after the axis has turned it.
    const Matrix3d seen = Eigen::AngleAxisd{angle, keys_.axis.direction}.toRotationMatrix();
    const Vector3d ideal = seen * place;
    Vector3d model_at = ideal;
    auto by_common = rows.common.middleRows<3>(row);
    auto by_own = rows.own.middleRows<3>(row);
    if (reading.angle) {
      model_at = own.head<3>() + turned(own.segment<3>(3)) * ideal;
      by_own.leftCols<6>() = weight_ * smallMotionRows(ideal);
    }
    by_common.middleCols<6>(mount) = weight_ * seen * smallMotionRows(place);
    if (balls_at_ < stops_at_) by_common.middleCols<3>(ball) = weight_ * seen * start.rotation;
    if (stops_at_ < offset_at_) {
      const Vector3d by_stop = weight_ * keys_.axis.direction.cross(ideal);
      if (reading.angle)
        by_own.col(6 + of_mount) = by_stop;
      else
        by_common.col(stops_at_ + of_mount) = by_stop;
    }
    if (offset_at_ < common_size_) {
      model_at += common.segment<3>(offset_at_);
      by_common.middleCols<3>(offset_at_) = weight_;
    }
    if (reading.station) {
      const Index station = stations_at_ + 3 * static_cast<Index>(*reading.station);
      model_at += common.segment<3>(station);
      by_common.middleCols<3>(station) = weight_;
    }
    rows.residuals.segment<3>(row) = weight_ * (model_at - reading.at);
  }

  // Takes rigid motion out of the errors of the stations: that is the place of the plate.
  void addGauge(BlockRows& rows, Index from, const VectorXd& common) const {
    const double sigma = kGaugeSigma * keys_.sigma.value;
    for (std::size_t j = 0; j < stack_.second_count; ++j) {
      const auto& reading = stack_.readings[j];
      const Index row = from + 6 * static_cast<Index>(reading.mount);
      const Index station = stations_at_ + 3 * static_cast<Index>(j);
      Eigen::Matrix<double, 3, 6> rigid = smallMotionRows(idealOf(stack_, reading, keys_.axis));
      rigid.rightCols<3>() /= 100.0;  // mm: like the translations
      rows.common.block<6, 3>(row, station) += rigid.transpose() / sigma;
      rows.residuals.segment<6>(row) += rigid.transpose() * common.segment<3>(station) / sigma;
    }
  }

  const PlateReadings& stack_;
  const Keys& keys_;
  Matrix3d weight_;
  std::vector<std::vector<std::size_t>> readings_of_;  // of each angle, then of second
  Index mounts_{};
  Index stations_at_{};
  Index balls_at_{};
  Index stops_at_{};
  Index offset_at_{};
  Index common_size_{};
  Index own_size_{};
};

// The errors alone, without the stops.
AngleErrors errorsOf(const PlateReadings& stack, const BlockFit& fit) {
  AngleErrors errors{stack.angles, VectorXd{6 * std::ssize(stack.angles)}, {{}, {}, fit.cofactor.common}};
  for (std::size_t k = 0; k < stack.angles.size(); ++k) {
    errors.six.segment<6>(6 * static_cast<Index>(k)) = fit.unknowns.own[k].head<6>();
    errors.cofactor.own.emplace_back(fit.cofactor.own[k].topLeftCorner<6, 6>());
    errors.cofactor.carried.emplace_back(fit.cofactor.carried[k].topRows<6>());
  }
  return errors;
}

// With errors of the stations the second coordinates agree with the certificate by construction.
std::optional<Refusal> badSecond(const PlateReadings& stack, const Fit& fit, const Keys& keys) {
  if (!keys.sigma.stated || keys.station_radius) return std::nullopt;
  const auto rows = 3 * static_cast<Index>(stack.second_count);
  Index worst = 0;
  const double sigmas = fit.residuals.head(rows).cwiseAbs().maxCoeff(&worst);
  const double off = (inverse(weightOf(keys)) * fit.residuals.segment<3>(worst / 3 * 3)).cwiseAbs().maxCoeff();
  if (sigmas <= kWorstResidual_sigma || off <= kBallResidualFloor_mm) return std::nullopt;
  return Refusal{"residual-too-large", "row " + std::to_string(worst / 3 + 1) + " of table 'second' is " + text(off) +
                                           " mm off, more than 5 sigma: measure it again"};
}

// Read minus fitted, one a coordinate.
Residuals residualsOf(const PlateReadings& stack, const Fit& fit, const Keys& keys) {
  const Matrix3d sigma = inverse(weightOf(keys));
  Residuals residuals{.unit = "mm", .against = std::string{column::kPhi}, .names = {}, .at = {}, .values = {}};
  for (std::size_t k = 0; k < 3 * stack.readings.size(); ++k) {
    const PlateReading& reading = stack.readings[k / 3];
    const auto of_ball = static_cast<Index>(3 * (k / 3)), coordinate = static_cast<Index>(k % 3);
    const double angle = reading.angle ? stack.angles[*reading.angle] : 0.0;
    residuals.names.push_back((reading.angle ? "first, " + text(degrees(angle)) + " degrees" : "second") + ", mount " +
                              std::to_string(reading.mount + 1) + ", ball " + std::to_string(reading.ball + 1) + ", " +
                              "xyz"[k % 3] + "_mm");
    residuals.at.push_back(angle);
    residuals.values.push_back(-(sigma * fit.residuals.segment<3>(of_ball))[coordinate]);
  }
  return residuals;
}

}  // namespace

Outcome<Result, Refusal> solveRotaryStack(const Dataset& dataset) {
  TRY(const auto keys, keysOf(dataset));
  TRY(auto stack, readPlates(dataset, keys.axis));
  if (auto refusal = badRank(stack, keys.axis)) return *refusal;
  if (keys.station_radius) {
    if (auto refusal = findStations(stack, keys.axis, *keys.station_radius)) return *refusal;
  }
  const StackModel model{stack, keys};
  TRY(const auto found, leastSquaresInBlocks(model, model.start()));
  Fit fit;
  fit.residuals = model.residuals(found.unknowns);
  fit.dof = found.dof;
  fit.condition = found.condition;
  if (auto refusal = badSecond(stack, fit, keys)) return *refusal;
  const auto errors = errorsOf(stack, found);
  if (auto refusal = tooLargeErrors(errors.angles, errors.six)) return *refusal;

  Answer answer = answerOf(dataset, keys.sigma, fit, errors, keys.axis.direction);
  answer.result().residuals = residualsOf(stack, fit, keys);
  const auto& left = answer.result().residuals.values;
  answer.result().rms =
      VectorXd::Map(left.data(), static_cast<Index>(left.size())).norm() / std::sqrt(static_cast<double>(left.size()));
  addNominalAxis(answer.result(), keys.axis);
  return std::move(answer).take(true);
}

}  // namespace probebox::metrology
