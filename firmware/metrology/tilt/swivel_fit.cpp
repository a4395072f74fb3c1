#include "firmware/metrology/tilt/swivel_fit.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "firmware/metrology/tilt/swivel_stops.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kLeastSine = 0.2;
constexpr double kAcross = 0.1;  // sine: how far along the tool it may be
constexpr Index kTool = 2;       // along Z while the head is level

std::vector<SwivelReading> readingsOf(const Table& table) {
  std::vector<SwivelReading> readings;
  const auto value = [&](std::size_t column, std::size_t row) { return (*table.column(kShankColumns[column]))[row]; };
  for (std::size_t row = 0; row < table.rows(); ++row) {
    readings.push_back({value(0, row), value(1, row), {value(2, row), value(3, row), value(4, row)}});
  }
  return readings;
}

Outcome<std::vector<ShankTouch>, Refusal> touchesOf(const Dataset& dataset, const SwivelPlane& plane) {
  TRY(const auto table, checkedTable(dataset, "shank", kShankColumns));
  std::vector<ShankTouch> touches;
  for (const auto& reading : readingsOf(*table)) {
    const std::size_t row = touches.size();
    const auto part = [&](std::size_t column) { return (*table->column(kShankColumns[column]))[row]; };
    const Vector3d side{part(5), part(6), part(7)};
    const Vector3d tool =
        Eigen::AngleAxisd{plane.sense * reading.swivel_deg * kDegree, Vector3d::Unit(plane.axis)} * Vector3d::UnitZ();
    if (std::abs(side.norm() - 1.0) > kUnitLength || std::abs(side.dot(tool)) > kAcross) {
      return Refusal{"bad-direction", "table 'shank', row " + std::to_string(row + 1) +
                                          ": ux, uy, uz must be a unit vector across the tool, from the ball to the "
                                          "side that was touched"};
    }
    touches.push_back({reading, side.normalized()});
  }
  return touches;
}

bool opposed(const std::vector<ShankTouch>& touches) {
  return std::ranges::any_of(touches, [&](const ShankTouch& a) {
    return std::ranges::any_of(touches, [&](const ShankTouch& b) {
      return std::abs(a.reading.swivel_deg - b.reading.swivel_deg) < kSameStop_deg &&
             a.side.dot(b.side) < kOppositeCosine;
    });
  });
}

std::optional<Refusal> badShank(const SwivelReadings& readings, const SwivelPlane& plane) {
  if (plane.axis == kTool) {
    return Refusal{"bad-axis",
                   "a head that swivels about Z does not displace a tool along Z: give swivel_axis along X or Y when a "
                   "shank is used"};
  }
  const auto isOther = [&](const auto& reading) { return reading.length_mm != readings.tips.front().length_mm; };
  if (std::ranges::any_of(readings.tips, isOther)) {
    return Refusal{"several-tips",
                   "a case with a shank has tips of several lengths: give only those of the shank's own tool"};
  }
  if (!opposed(readings.shank)) {
    return Refusal{"not-opposed",
                   "the shank never touched from opposite sides, so its radius cannot be separated from the position: "
                   "touch the ball from both sides at one angle of B at least"};
  }
  return std::nullopt;
}

std::optional<Refusal> badSpan(const SwivelReadings& readings) {
  std::vector<SwivelReading> all = readings.tips;
  for (const auto& touch : readings.shank) all.push_back(touch.reading);
  const auto [shortest, longest] = std::ranges::minmax(all, {}, &SwivelReading::length_mm);
  if (longest.length_mm - shortest.length_mm < kLeastLengthSpan_mm) {
    return Refusal{"length-span-too-small", "the tool lengths span " + text(longest.length_mm - shortest.length_mm) +
                                                " mm, less than 10: read with two probes, two tips, or tip and shank"};
  }
  const auto sine = [](const SwivelReading& reading) { return std::abs(std::sin(reading.swivel_deg * kDegree)); };
  if (sine(std::ranges::max(readings.tips, {}, sine)) < kLeastSine) {
    return Refusal{"swivel-angle-too-small", "no reading has |sin B| above 0.2: swivel to 90 degrees, and to 45"};
  }
  return std::nullopt;
}

std::vector<double> lengthsOf(const std::vector<SwivelReading>& tips) {
  std::vector<double> lengths;
  for (const auto& reading : tips) {
    if (std::ranges::find(lengths, reading.length_mm) == lengths.end()) lengths.push_back(reading.length_mm);
  }
  return lengths;
}

MatrixXd withoutColumn(const MatrixXd& all, std::optional<Index> column) {
  if (!column) return all;
  MatrixXd rest{all.rows(), all.cols() - 1};
  rest << all.leftCols(*column), all.rightCols(all.cols() - *column - 1);
  return rest;
}

// Design and values over sigma, rows of one stop of B freed of what they share.
struct WeightedRows {
  MatrixXd design;
  Eigen::VectorXd values;
};

WeightedRows weightedRows(const SwivelReadings& readings, const SwivelModel& model, double sigma) {
  WeightedRows rows{swivelDesign(readings, model) / sigma, swivelValues(readings, model.plane.axis) / sigma};
  if (readings.stop_sd_rad > 0)
    shareErrors(rows.design, rows.values, movedByStops(readings, model.plane) / sigma, stopOfEachRow(readings));
  return rows;
}

}  // namespace

Index SwivelModel::parameters() const {
  if (kind == SwivelKind::sine) return 6;
  if (kind == SwivelKind::free) return 12;
  return (one_minus_cosine ? 8 : 6) - (without ? 1 : 0);
}

MatrixXd SwivelModel::map() const {
  MatrixXd map = MatrixXd::Zero(12, parameters() + (without ? 1 : 0));
  if (kind != SwivelKind::rigid) {
    const Index each = kind == SwivelKind::sine ? 2 : 4;
    for (Index k = 0; k < 3; ++k) map.block(4 * k, each * k, each, each).setIdentity();
  } else {
    // -(R2(B) - I) (q + L t): q in 0 and 1, t in 2 and 3.
    for (const Index l : {0, 1}) {
      map(4 * plane.first + l, 2 * l + 1) = 1.0;
      map(4 * plane.first + 2 + l, 2 * l) = 1.0;
      map(4 * plane.second + l, 2 * l) = -1.0;
      map(4 * plane.second + 2 + l, 2 * l + 1) = 1.0;
    }
    const Index along = one_minus_cosine ? 4 : 2;
    map.block(4 * plane.axis, 4, along, along).setIdentity();
  }
  for (Index k = 0; k < 3; ++k) map.middleRows(4 * k, 2) *= plane.sense;  // sin of the turned sense
  return without ? withoutColumn(map, 2 + *without) : map;
}

MatrixXd SwivelModel::terms(double swivel_deg, double length_mm) const {
  const double sine = std::sin(swivel_deg * kDegree);
  const double rest = 1.0 - std::cos(swivel_deg * kDegree);
  MatrixXd factors = MatrixXd::Zero(3, 12);
  for (Index k = 0; k < 3; ++k) {
    factors.row(k).segment<4>(4 * k) << sine, sine * length_mm, rest, rest * length_mm;
  }
  return factors * map();
}

MatrixXd SwivelModel::direction() const {
  MatrixXd whole = MatrixXd::Zero(2, parameters() + (without ? 1 : 0));
  whole.middleCols<2>(2).setIdentity();
  return without ? withoutColumn(whole, 2 + *without) : whole;
}

Outcome<SwivelReadings, Refusal> readSwivelReadings(const Dataset& dataset, const SwivelPlane& plane) {
  TRY(const auto table, checkedTable(dataset, "readings", kSwivelColumns));
  SwivelReadings readings{.tips = readingsOf(*table), .shank = {}};
  if (dataset.table("shank")) {
    TRY(auto touches, touchesOf(dataset, plane));
    readings.shank = std::move(touches);
    if (auto refusal = badShank(readings, plane)) return *refusal;
  }
  if (auto refusal = badSpan(readings)) return *refusal;
  return readings;
}

bool SwivelStop::level() const {
  return std::abs(std::remainder(swivel_deg, 360.0)) <= kPoseTolerance_deg;
}

std::vector<SwivelStop> swivelStops(const SwivelReadings& readings) {
  const auto& tips = readings.tips;
  std::vector<SwivelStop> stops;
  const auto fromFirst = [&](const SwivelStop& stop, std::size_t tip) {
    return std::remainder(tips[tip].swivel_deg - tips[stop.tips.front()].swivel_deg, 360.0);
  };
  for (std::size_t tip = 0; tip < tips.size(); ++tip) {
    auto at = std::ranges::find_if(
        stops, [&](const SwivelStop& stop) { return std::abs(fromFirst(stop, tip)) <= kSameStop_deg; });
    if (at == stops.end()) at = stops.insert(stops.end(), SwivelStop{});
    at->tips.push_back(tip);
  }
  for (auto& stop : stops) {
    double sum = 0.0;
    for (const auto tip : stop.tips) sum += fromFirst(stop, tip);
    stop.swivel_deg = tips[stop.tips.front()].swivel_deg + sum / static_cast<double>(stop.tips.size());
  }
  std::ranges::sort(stops, {}, &SwivelStop::swivel_deg);
  return stops;
}

std::size_t swivelAngles(const SwivelReadings& readings) {
  const auto stops = swivelStops(readings);
  return stops.size() - static_cast<std::size_t>(std::ranges::count_if(stops, &SwivelStop::level));
}

MatrixXd swivelDesign(const SwivelReadings& readings, const SwivelModel& model) {
  const auto& tips = readings.tips;
  const auto& shank = readings.shank;
  const auto lengths = lengthsOf(tips);
  const Index own = model.parameters(), of_shank = own + static_cast<Index>(3 * lengths.size());
  const auto rows = static_cast<Index>(3 * tips.size());
  MatrixXd design = MatrixXd::Zero(rows + static_cast<Index>(shank.size()), of_shank + (readings.byShank() ? 2 : 0));
  for (std::size_t k = 0; k < tips.size(); ++k) {
    const auto row = static_cast<Index>(3 * k);
    const auto base = 3 * (std::ranges::find(lengths, tips[k].length_mm) - lengths.begin());
    design.block(row, 0, 3, own) = model.terms(tips[k].swivel_deg, tips[k].length_mm);
    design.block<3, 3>(row, own + base).setIdentity();
    design.row(row + model.plane.axis) /= readings.along_spread;
  }
  const auto& plane = model.plane;
  for (std::size_t k = 0; k < shank.size(); ++k) {
    const auto& [reading, side] = shank[k];
    // What it reports in all three coordinates.
    MatrixXd whole = MatrixXd::Zero(3, design.cols());
    whole.leftCols(own) = model.terms(reading.swivel_deg, reading.length_mm);
    whole.middleCols<3>(own).setIdentity();
    const MatrixXd shift = (tips.front().length_mm - reading.length_mm) * model.direction();
    whole.row(plane.first).head(own) += shift.row(0);
    whole.row(plane.second).head(own) += shift.row(1);
    whole(plane.axis, of_shank) = 1.0;
    const auto row = rows + static_cast<Index>(k);
    design.row(row) = side.transpose() * whole;
    design(row, of_shank + 1) = 1.0;
    design.row(row) /= readings.shank_spread;
  }
  return design;
}

Eigen::VectorXd swivelValues(const SwivelReadings& readings, Index axis) {
  const auto tips = static_cast<Index>(readings.tips.size());
  Eigen::VectorXd values{3 * tips + static_cast<Index>(readings.shank.size())};
  for (Index k = 0; k < tips; ++k) {
    values.segment<3>(3 * k) = readings.tips[static_cast<std::size_t>(k)].at;
    values[3 * k + axis] /= readings.along_spread;
  }
  Index row = 3 * tips;
  for (const auto& [reading, side] : readings.shank) values[row++] = side.dot(reading.at) / readings.shank_spread;
  return values;
}

Outcome<Fit, Refusal> fitSwivel(const SwivelReadings& readings, const SwivelModel& model, double sigma) {
  const auto [design, values] = weightedRows(readings, model, sigma);
  return linearLeastSquares(design, values);
}

Outcome<Fit, Refusal> fitEitherShape(const SwivelReadings& readings, SwivelModel model, const Fit& found,
                                     const Sigma& sigma) {
  auto lengths = lengthsOf(readings.tips);
  for (const auto& touch : readings.shank) lengths.push_back(touch.reading.length_mm);
  const auto [shortest, longest] = std::ranges::minmax(lengths);
  const auto steepest = [](const SwivelReading& reading) { return std::abs(std::sin(reading.swivel_deg * kDegree)); };
  const double angle = std::ranges::max(readings.tips, {}, steepest).swivel_deg;
  const double rest = 1.0 - std::cos(angle * kDegree);
  const Eigen::VectorXd terms = found.parameters.head(model.parameters());
  const double of_fit = found.dof > 0 ? std::sqrt(found.sumOfSquares() / static_cast<double>(found.dof)) : 1.0;
  const double sd = sigma.stated ? 1.0 : std::max(of_fit, kCaseDigits / sigma.value);  // of a reading, in sigma
  const auto seenAt = [&](double length_mm) { return (model.terms(angle, length_mm) * terms)[model.plane.axis]; };
  const Eigen::Vector2d seen{seenAt(shortest), seenAt(longest)};
  model.one_minus_cosine = true;
  const auto [own, of_readings] = weightedRows(readings, model, sigma.value);
  const Index rows = own.rows();
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows + 2, own.cols());
  design.topRows(rows) = own;
  // Both tools have as much of it, but for noise: the second row holds that.
  Eigen::Matrix2d at_lengths;
  at_lengths << 1.0, shortest, 1.0, longest;
  const Eigen::Vector2d along = seen.norm() > 0.0 ? seen.normalized() : Eigen::Vector2d{1.0, 0.0};
  const double noise_mm = sd * sigma.value * readings.along_spread;
  Eigen::Matrix2d weights;
  weights.row(0) = along.transpose() / std::hypot(seen.norm(), noise_mm);
  weights.row(1) = Eigen::RowVector2d{-along.y(), along.x()} / noise_mm;
  design.bottomRows(2).middleCols(model.parameters() - 2, 2) = sd * rest * weights * at_lengths;
  Eigen::VectorXd values = Eigen::VectorXd::Zero(rows + 2);
  values.head(rows) = of_readings;
  auto fit = linearLeastSquares(design, values);
  if (fit) fit->residuals.conservativeResize(rows);
  return fit;
}

}  // namespace probebox::metrology
