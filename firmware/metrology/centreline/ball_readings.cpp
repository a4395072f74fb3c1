#include "firmware/metrology/centreline/ball_readings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kRadiusSeen = 0.01;       // of the touches on a shank, least over greatest
constexpr double kInflationLimit = 400.0;  // |sin(alpha/2)| < 0.05 for two readings

// Whether the angles of all readings are within `most_rad` of the first, whole turns aside.
template <class Angle>
bool constant(std::span<const BallReading> readings, double most_rad, Angle&& angle) {
  const double first = angle(readings.front());
  return std::ranges::all_of(readings, [&](const BallReading& reading) {
    return std::abs(std::remainder(angle(reading) - first, kTurn)) <= most_rad;
  });
}

constexpr std::string_view kCheckAngles =
    "that A_rad and C_rad are not exchanged, and the signs and units of x_mm and y_mm";

// Readings at one stop of an axis separate nothing; the difference of two axes has the errors of both.
std::optional<Turned> turnedOf(std::span<const BallReading> readings) {
  const bool c = !constant(readings, kSameStop_rad, [](const BallReading& reading) { return reading.c; });
  const bool spindle = !constant(readings, kSameStop_rad, [](const BallReading& reading) { return reading.spindle; });
  if (!c && !spindle) return std::nullopt;
  if (!spindle) return Turned::c_only;
  if (!c) return Turned::spindle_only;
  const bool same =
      constant(readings, 2 * kSameStop_rad, [](const BallReading& reading) { return reading.spindle - reading.c; });
  return same ? Turned::together : Turned::both;
}

Refusal tooClose(const std::string& which) {
  return {"angles-too-close", "the angles of the readings are equal or too close together to separate " + which +
                                  ": turn the axis by 180 degrees between readings, by at least 6"};
}

std::optional<Refusal> slopeHidden(const BallModel& model, Turned turned) {
  if (!model.sloped) return std::nullopt;
  if (turned == Turned::c_only && model.stylus_per_set) {
    return Refusal{"spindle-not-turned",
                   "the spindle stood still: the offset of its tips from the axis cannot be separated from a tilt; "
                   "read with the spindle at 0 and 180 degrees"};
  }
  if (turned == Turned::spindle_only && model.arm_per_set) {
    return Refusal{"c-not-turned",
                   "the C axis stood still: the offset of the balls from the axis cannot be separated from a tilt; "
                   "read with C at 0 and 180 degrees"};
  }
  return std::nullopt;
}

// Whether the touches of a shank tell its radius from its run-out. Where it always met the ball with the same two
// points of itself, as (B16) has it, they do not, and need not: the run-out then holds both.
bool radiusSeen(std::span<const BallReading> readings, std::size_t set) {
  Eigen::Matrix3d seen = Eigen::Matrix3d::Zero();
  for (const auto& reading : readings) {
    if (reading.set != set || !reading.shank_side) continue;
    const Eigen::Vector2d on_shank = turn(-reading.spindle) * *reading.shank_side;
    const Eigen::Vector3d row{on_shank.x(), on_shank.y(), 1.0};
    seen += row * row.transpose();
  }
  const Eigen::VectorXd spread = symmetricEigenvalues(seen);
  return spread[0] > kRadiusSeen * spread[2];
}

// Which unknown stands where: o, k, then the arms, the styli and the radii of the shanks.
class Columns {
 public:
  Columns(std::span<const BallReading> readings, const BallModel& model, Turned turned) : sloped_{model.sloped} {
    const std::size_t sets = 1 + std::ranges::max(readings, {}, &BallReading::set).set;
    const bool merged = turned == Turned::together;
    const auto add = [this](std::size_t vectors) {
      return std::exchange(count_, count_ + static_cast<Eigen::Index>(2 * vectors));
    };
    add(sloped_ ? 2 : 1);
    arm_per_set_ = model.arm_per_set || (merged && model.stylus_per_set);
    stylus_per_set_ = model.stylus_per_set;
    if (turned != Turned::spindle_only) arms_ = add(arm_per_set_ ? sets : 1);
    if (turned == Turned::both || turned == Turned::spindle_only) styli_ = add(stylus_per_set_ ? sets : 1);
    for (std::size_t set = 0; set < sets; ++set) {
      if (radiusSeen(readings, set)) radii_.emplace(set, count_++);
    }
  }

  Eigen::Index count() const { return count_; }
  Eigen::Index arms() const { return arms_; }
  Eigen::Index styli() const { return styli_; }
  Eigen::Index stylusOf(const BallReading& reading) const { return at(styli_, stylus_per_set_, reading); }
  // Where the arm of a reading stands.
  Eigen::Index armOf(const BallReading& reading) const { return at(arms_, arm_per_set_, reading); }

  // d (x, y) / d unknowns. Shape: 2 x count().
  Eigen::MatrixXd rowsOf(const BallReading& reading) const {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, count_);
    rows.leftCols<2>().setIdentity();
    if (sloped_) rows.middleCols<2>(2) = reading.lever * Eigen::Matrix2d::Identity();
    if (arms_ >= 0) rows.middleCols<2>(armOf(reading)) = turn(reading.c);
    if (styli_ >= 0) rows.middleCols<2>(stylusOf(reading)) = -turn(reading.spindle);
    if (const auto radius = radii_.find(reading.set); radius != radii_.end())
      rows.col(radius->second) = *reading.shank_side;
    return rows;
  }

 private:
  static Eigen::Index at(Eigen::Index first, bool per_set, const BallReading& reading) {
    return first + static_cast<Eigen::Index>(per_set ? 2 * reading.set : 0);
  }

  bool sloped_{};
  bool arm_per_set_{};
  bool stylus_per_set_{};
  Eigen::Index count_{};
  Eigen::Index arms_{-1};
  Eigen::Index styli_{-1};
  std::map<std::size_t, Eigen::Index> radii_;  // by set
};

// Every row divided by its own sd.
struct Rows {
  Eigen::MatrixXd design;
  Eigen::VectorXd values;
  std::vector<const BallReading*> readings;
};

Rows rowsOf(std::span<const BallReading> readings, const Columns& columns, double sigma) {
  Eigen::Index count = 0;
  for (const auto& reading : readings) count += reading.shank_side ? 1 : 2;
  Rows rows{Eigen::MatrixXd::Zero(count, columns.count()), Eigen::VectorXd{count}, {}};
  for (const auto& reading : readings) {
    const double sd = sigma * reading.spread;
    const Eigen::MatrixXd both = columns.rowsOf(reading) / sd;
    const auto row = static_cast<Eigen::Index>(rows.readings.size());
    if (const auto& side = reading.shank_side) {
      rows.design.row(row) = side->transpose() * both;
      rows.values[row] = side->dot(reading.at) / sd;
      rows.readings.push_back(&reading);
    } else {
      rows.design.middleRows<2>(row) = both;
      rows.values.segment<2>(row) = reading.at / sd;
      rows.readings.insert(rows.readings.end(), 2, &reading);
    }
  }
  return rows;
}

// Returns how far one sd of the angle of C moves each row, in sds of the row. Where spindle and C turned together, r -
// s stands for r, from which a stylus in its spindle differs by a few micrometres.
Eigen::VectorXd movedByC(const Rows& rows, const Columns& columns, const Eigen::VectorXd& parameters,
                         const RotationNoise& noise) {
  Eigen::VectorXd moved{rows.values.size()};
  for (Eigen::Index row = 0; row < moved.size();) {
    const BallReading& reading = *rows.readings[static_cast<std::size_t>(row)];
    const Eigen::Vector2d arm = parameters.segment<2>(columns.armOf(reading)) + reading.beyond;
    const Eigen::Vector2d step = noise.angle / (noise.position * reading.spread) * (turn(reading.c + kTurn / 4) * arm);
    if (const auto& side = reading.shank_side) {
      moved[row++] = side->dot(step);
    } else {
      moved.segment<2>(row) = step;
      row += 2;
    }
  }
  return moved;
}

// Fits again, with what the stops of C are off. The arms of the first fit are known well enough for that.
Outcome<Fit, Refusal> fitWithStops(Rows rows, const Columns& columns, const Eigen::VectorXd& parameters,
                                   const RotationNoise& noise) {
  std::vector<double> stops;
  for (const auto* reading : rows.readings) stops.push_back(reading->stop);
  shareErrors(rows.design, rows.values, movedByC(rows, columns, parameters, noise), stops);
  return linearLeastSquares(rows.design, rows.values);
}

// The stop of C of every row.
std::vector<double> stopsOf(const Table& table) {
  if (const auto* numbers = table.column(kStop)) return *numbers;
  return stopsByAngle(*table.column(column::kC));
}

// Sets of readings at one lever.
class Sets {
 public:
  explicit Sets(double same_lever_mm) : same_lever_mm_{same_lever_mm} {}

  // Number of the set of a reading; of a new one where no set is of this lever and part.
  std::size_t of(double lever, double part) {
    const auto found = std::ranges::find_if(
        sets_, [&](const Set& set) { return set.part == part && std::abs(set.first - lever) <= same_lever_mm_; });
    if (found == sets_.end()) {
      sets_.push_back({.first = lever, .part = part, .beyond = 0.0, .count = 1.0});
      return sets_.size() - 1;
    }
    found->beyond += lever - found->first;
    found->count += 1.0;
    return static_cast<std::size_t>(found - sets_.begin());
  }

  // Mean of each set.
  std::vector<double> levers() const {
    std::vector<double> means;
    for (const auto& set : sets_) means.push_back(set.first + set.beyond / set.count);
    return means;
  }

 private:
  struct Set {
    double first{};  // lever
    double part{};
    double beyond{};  // sum of the levers less the first
    double count{};
  };
  double same_lever_mm_{};
  std::vector<Set> sets_;
};

// Whether o or k is far less certain than a reading, because of the angles at which they were read.
bool badlyAngled(const Fit& fit, std::span<const BallReading> readings, bool sloped, double sigma) {
  double levers = 0.0;
  for (const auto& reading : readings) levers += reading.lever * reading.lever;
  const double unit = 1.0 / (sigma * sigma);
  return inflation(fit.cofactor(0, 0) * unit, readings.size()) > kInflationLimit ||
         (sloped && fit.cofactor(2, 2) * unit * levers > kInflationLimit);
}

}  // namespace

Outcome<BallFit, Refusal> fitBall(std::span<const BallReading> readings, const BallModel& model,
                                  const RotationNoise& noise) {
  const auto turned = turnedOf(readings);
  if (!turned) return tooClose("the axis from the ball's offset");
  if (auto refusal = slopeHidden(model, *turned)) return *refusal;
  const Columns columns{readings, model, *turned};
  const Rows rows = rowsOf(readings, columns, noise.position);
  auto fit = linearLeastSquares(rows.design, rows.values);
  if (!fit) {
    return fit.error().name == "ill-conditioned" ? tooClose("the axes from the offsets of ball and stylus")
                                                 : fit.error();
  }
  if (badlyAngled(*fit, readings, model.sloped, noise.position))
    return tooClose("the axes from the offsets of ball and stylus");
  if (noise.angle > 0 && columns.arms() >= 0) fit = fitWithStops(rows, columns, fit->parameters, noise);
  if (!fit) return fit.error();
  for (const auto& reading : readings) {
    if (columns.styli() < 0 || reading.shank_side) continue;  // a shank's may hold its radius
    const double off_mm = fit->parameters.segment<2>(columns.stylusOf(reading)).norm();
    if (auto refusal = refuseStylusOff(off_mm, "table 'readings'", kCheckAngles)) return *refusal;
  }
  return BallFit{std::move(fit).value(), *turned, columns.arms(), columns.styli()};
}

double BallTable::leverSpan() const {
  const auto [least, greatest] = std::ranges::minmax(levers);
  return greatest - least;
}

void BallTable::centreLevers() {
  double sum = 0.0;
  for (const auto& reading : readings) sum += levers[reading.set];
  mean_lever = sum / static_cast<double>(readings.size());
  for (auto& reading : readings) reading.lever = levers[reading.set] - mean_lever;
}

Outcome<BallTable, Refusal> readBallTable(const Dataset& dataset, const BallColumns& named) {
  const double no_lever = 0.0;
  std::vector<std::string_view> columns{column::kA, column::kC, column::kX, column::kY};
  if (!named.lever.empty()) columns.push_back(named.lever);
  columns.insert(columns.end(), named.further.begin(), named.further.end());
  if (!named.parted_by.empty()) columns.push_back(named.parted_by);
  const Table* given = dataset.table(named.table);
  const bool numbered = given != nullptr && given->column(kStop) != nullptr;
  if (numbered && std::ranges::find(columns, kStop.name) == columns.end()) columns.push_back(kStop);
  TRY(const auto table, checkedTable(dataset, named.table, columns));
  TRY(const auto spindle_sense, configSense(dataset, "A_sense"));
  TRY(const auto c_sense, configSense(dataset, "C_sense"));
  const auto value = [&](std::string_view column, std::size_t row) {
    return column.empty() ? no_lever : (*table->column(column))[row];
  };

  BallTable ball{.readings = {}, .warnings = equalRows(*table), .levers = {}, .mean_lever = 0.0};
  Sets sets{named.same_lever_mm};
  const std::size_t rows = table->rows();
  const auto stops = stopsOf(*table);
  for (std::size_t row = 0; row < rows; ++row) {
    const double lever = value(named.lever, row);
    const auto set = sets.of(lever, value(named.parted_by, row));
    ball.readings.push_back({.at = {value(column::kX, row), value(column::kY, row)},
                             .spindle = spindle_sense * value(column::kA, row),
                             .c = c_sense * value(column::kC, row),
                             .set = set,
                             .lever = lever,
                             .stop = stops[row]});
  }
  ball.levers = sets.levers();
  ball.centreLevers();
  return ball;
}

}  // namespace probebox::metrology
