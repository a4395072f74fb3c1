#include "firmware/metrology/scan/contour_scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/frozen_samples.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/scan/scan_points.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kTransition_s = 0.020;  // of a step of the distance
constexpr double kLeastRate = 10.0;      // squares of the rate against those of its noise
constexpr double kLeastSquare = 1e-8;    // mm^2/s^2, of the rate: the digits of a case file
constexpr double kRival = 0.6;           // of the highest peak
constexpr double kSeen = 0.05;        // rms of the normals along a direction in which an error of the place is fitted
constexpr double kHardlySeen = 0.01;  // and along one where it is, unless it looks like the steps
constexpr double kLikeSteps = 0.25;   // of their squares
constexpr double kOwnShare = 0.05;    // of the squares of the rate, that no error of the place may look like

// Directions in which the normals of a scan differ, and by how much (mean square), rising: an error of the feature's
// place along others looks like one of its size, or like nothing at all.
SymmetricEigen directionsOf(const Eigen::MatrixX3d& normals) {
  const Eigen::MatrixX3d centred = normals.rowwise() - normals.colwise().mean();
  const Eigen::Matrix3d scatter = centred.transpose() * centred / static_cast<double>(normals.rows());
  return symmetricEigen(scatter);
}

VectorXd mapped(const std::vector<double>& values) {
  return VectorXd::Map(values.data(), static_cast<Index>(values.size()));
}

// Shapes of the errors of the distance, one column each: a constant, and an error of the place along each direction.
Eigen::MatrixXd errorShapes(const ContourScan& scan) {
  Eigen::MatrixXd shapes{static_cast<Index>(scan.distance.values.size()), 1 + static_cast<Index>(scan.places.size())};
  shapes.col(0).setOnes();
  for (std::size_t k = 0; k < scan.places.size(); ++k) shapes.col(1 + static_cast<Index>(k)) = mapped(scan.places[k]);
  return shapes;
}

// Residuals of values after a fit of the columns of shapes.
VectorXd without(const Eigen::MatrixXd& shapes, const VectorXd& values) {
  return values - shapes * solveSquare(shapes.transpose() * shapes, shapes.transpose() * values);
}

// Distance after the fit of the shapes of its errors.
std::vector<double> stepsOf(const ContourScan& scan) {
  const Eigen::MatrixXd shapes = errorShapes(scan);
  const VectorXd distance = mapped(scan.distance.values);
  const VectorXd steps = without(shapes, distance);
  return {steps.begin(), steps.end()};
}

// Whether an error of the place that is not among the scan's yet would explain much of its steps.
bool likeSteps(const ContourScan& scan, const VectorXd& place) {
  const Eigen::MatrixXd shapes = errorShapes(scan);
  const VectorXd own = without(errorShapes(scan), place);
  const VectorXd steps = mapped(stepsOf(scan));
  return std::pow(own.dot(steps), 2) > kLikeSteps * own.squaredNorm() * steps.squaredNorm();
}

// Columns in the order of how well they are seen. What is hardly seen is fitted too, unless it looks like the steps:
// then only a feature that stands millimetres off would explain them.
void addPlaces(ContourScan& scan, const Eigen::MatrixX3d& normals) {
  const auto axes = directionsOf(normals);
  for (Index k = 2; k >= 0; --k) {
    const double seen = std::sqrt(std::max(axes.values[k], 0.0));
    if (seen <= kHardlySeen) return;
    const VectorXd column = normals * axes.vectors.col(k);
    if (seen <= kSeen && likeSteps(scan, column)) return;
    scan.places.emplace_back(column.begin(), column.end());
  }
}

ContourScan reduce(ScanPoints machine, ScanPoints probe, const ScanQuestion& question) {
  ContourScan scan;
  scan.distance.values.reserve(machine.values.size());
  Eigen::MatrixX3d normals{static_cast<Index>(machine.values.size()), 3};
  for (const auto& place : machine.values) {
    const Distance distance = question.feature.at(place);
    normals.row(static_cast<Index>(scan.distance.values.size())) = distance.normal.transpose();
    scan.distance.values.push_back(distance.mm);
  }
  addPlaces(scan, normals);
  scan.deflection.values.reserve(probe.values.size());
  for (const auto& d : probe.values) scan.deflection.values.push_back((question.gain * d).norm());
  scan.distance.times = std::move(machine.times);
  scan.deflection.times = std::move(probe.times);
  scan.step = stepsOf(scan);
  return scan;
}

// A rate of change, smoothed, without the ends that average less; and what noise adds to its square.
struct SmoothRate {
  VectorXd rate;
  Index from{};  // of the first value that it has
  double noise{};
};

SmoothRate smoothRate(const std::vector<double>& values, double variance, double period, double transition_s) {
  const auto half = std::max<Index>(1, static_cast<Index>(transition_s / 4.0 / period));
  const VectorXd smooth = boxed(boxed(mapped(values), half), half);
  const Index from = 2 * half + 1;
  const Index count = std::max<Index>(0, smooth.size() - 2 * from);
  // The rate of what was averaged twice over a length is the difference of two such averages, over it.
  const double length = static_cast<double>(2 * half + 1);
  return {(smooth.segment(std::min(from + 1, smooth.size() - count), count) -
           smooth.segment(std::min(from - 1, smooth.size() - count), count)) /
              (2.0 * period),
          from, 2.0 * variance / (std::pow(length, 3) * period * period)};
}

// Whether the rate of the distance does not stand out of its noise, smoothed over times as transitions take.
bool stands(const ContourScan& scan) {
  const double period = scan.distance.period();
  const double variance = sampleVariance(scan.distance, Interpolation::cubic);
  for (const double transition_s : {kTransition_s, 2.0 * kTransition_s, 4.0 * kTransition_s}) {
    const auto [rate, from, noise] = smoothRate(scan.step, variance, period, transition_s);
    if (rate.squaredNorm() >= static_cast<double>(rate.size()) * (kLeastRate * noise + kLeastSquare)) return false;
  }
  return true;
}

// Whether the rate, which is what a delay adds, looks like an error of the feature's place all along.
bool looksLikeAPlace(const ContourScan& scan) {
  const double variance = sampleVariance(scan.distance, Interpolation::cubic);
  const auto [rate, from, noise] =
      smoothRate(scan.distance.values, variance, scan.distance.period(), 2.0 * kTransition_s);
  const Eigen::MatrixXd shapes = errorShapes(scan).middleRows(from, rate.size());
  const VectorXd own = without(shapes, rate);
  return own.squaredNorm() - static_cast<double>(rate.size()) * noise < kOwnShare * rate.squaredNorm();
}

std::optional<Refusal> unusable(const ContourScan& scan, const ScanQuestion& question) {
  const double sigma = std::sqrt(sampleVariance(scan.deflection, Interpolation::cubic));
  if (*std::ranges::min_element(scan.deflection.values) < 5.0 * sigma + 1e-6) {
    return Refusal{"contact-lost", scan.name + ": the deflection falls to zero; scan with a larger deflection"};
  }
  if (stands(scan)) {
    return Refusal{"constant-" + question.varies, scan.name + ": the " + question.varies +
                                                      " does not change; scan with steps of the " + question.varies};
  }
  if (looksLikeAPlace(scan)) {
    return Refusal{"one-sided", scan.name +
                                    " cannot separate the delay from the position of the feature: at constant speed a "
                                    "delay looks like a displaced feature; change distance, direction or speed"};
  }
  const double lasts_s = question.in_circles ? kTurn * scan.distance.values.front() / scan.speed_mm_s
                                             : scan.distance.times.back() - scan.distance.times.front();
  if (question.window_s >= 0.5 * lasts_s) {
    return Refusal{"window-too-large", "search_window_s is " + text(question.window_s) + " s and " + scan.name +
                                           (question.in_circles ? " repeats after " : " ends after ") + text(lasts_s) +
                                           " s; give less than half of that"};
  }
  return std::nullopt;
}

std::optional<Refusal> unlisted(const Table& table, const std::vector<double>& ids) {
  double known = std::nan("");
  for (const double id : *table.column(column::kScan)) {
    if (id == known) continue;
    if (std::ranges::count(ids, id) != 1) {
      return Refusal{"unknown-scan", "scan " + text(id) + " of table '" + table.name +
                                         "' must be in table 'scans' exactly once; correct the table"};
    }
    known = id;
  }
  return std::nullopt;
}

// The rates of distance and deflection of one scan on one grid, from differences of short averages.
struct Rates {
  VectorXd distance;
  VectorXd deflection;
};

VectorXd ratesOf(const std::vector<double>& times, const std::vector<double>& values, double from, Index count,
                 double step) {
  const double period = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  const VectorXd smooth = boxed(mapped(values), static_cast<Index>(0.5 * step / period));
  const std::vector<double> smoothed{smooth.begin(), smooth.end()};
  VectorXd rates{count};
  std::size_t cursor = 0;
  double before = between(times, smoothed, from, cursor);
  for (Index k = 0; k < count; ++k) {
    const double at = between(times, smoothed, from + static_cast<double>(k + 1) * step, cursor);
    rates[k] = at - before;
    before = at;
  }
  return rates;
}

Rates ratesOf(const ContourScan& scan, double step) {
  const double from = std::max(scan.distance.times.front(), scan.deflection.times.front());
  const double until = std::min(scan.distance.times.back(), scan.deflection.times.back());
  const auto count = static_cast<Index>(std::max(0.0, until - from) / step);
  return {ratesOf(scan.distance.times, scan.step, from, count, step),
          ratesOf(scan.deflection.times, scan.deflection.values, from, count, step)};
}

// The highest value that is parted from the top by a valley: noise alone makes no rival.
double rivalOf(const std::vector<double>& sums, std::size_t top) {
  constexpr double kValley = 0.8;
  double rival = 0.0;
  double valley = sums[top];
  const auto look = [&](double value) {
    valley = std::min(valley, value);
    if (valley < kValley * value) rival = std::max(rival, value);
  };
  for (std::size_t lag = top + 1; lag < sums.size(); ++lag) look(sums[lag]);
  valley = sums[top];
  for (std::size_t lag = top; lag-- > 0;) look(sums[lag]);
  return rival;
}

// The pattern of the steps against itself, up to twice the window: where it repeats no window tells which step is
// which.
std::optional<Refusal> repeats(const std::vector<Rates>& rates, Index reach, double window_s) {
  std::vector<double> sums;
  for (Index lag = 0; lag <= 2 * reach; ++lag) {
    double sum = 0.0;
    for (const auto& scan : rates) {
      const Index n = scan.distance.size() - lag;
      if (n > 0) sum += scan.distance.head(n).dot(scan.distance.tail(n));
    }
    sums.push_back(sum);
  }
  if (rivalOf(sums, 0) <= kRival * sums.front()) return std::nullopt;
  return Refusal{"rival-peak", "the steps repeat within twice the search window of " + text(window_s) +
                                   " s, so several delays fit: scan with arcs of different lengths, or narrow "
                                   "search_window_s"};
}

}  // namespace

Outcome<double, Refusal> searchWindow(const Dataset& dataset) {
  const auto window = requiredPositive(dataset, "search_window_s");
  if (!window || window.value() >= kTransition_s) return window;
  return Refusal{"window-too-small",
                 "search_window_s is " + text(window.value()) + " s: a step takes 0.02 s; give at least that"};
}

Outcome<std::vector<ContourScan>, Refusal> readScans(const Dataset& dataset, const ScanQuestion& question) {
  TRY(const auto listed, checkedTable(dataset, "scans", kScansColumns));
  TRY(const auto machine, checkedTable(dataset, "machine", kScanMachineColumns));
  TRY(const auto probe, checkedTable(dataset, "probe", kScanProbeColumns));
  if (auto refusal = frozenSamples(*probe, column::kScan)) return *refusal;
  const auto& ids = *listed->column(column::kScan);
  for (const auto* table : {machine, probe}) {
    if (auto refusal = unlisted(*table, ids)) return *refusal;
  }
  std::vector<ContourScan> scans;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    const std::string name = "scan " + text(ids[row]);
    const double speed = (*listed->column(column::kSpeed))[row];
    if (speed <= 0.0) return Refusal{"bad-speed", name + ": speed_mm_s must be greater than zero"};
    TRY(auto of_machine, scanPoints(*machine, kScanMachineColumns, ids[row], name));
    TRY(auto of_probe, scanPoints(*probe, kScanProbeColumns, ids[row], name));
    if (auto refusal = speedDiffers(of_machine, name, speed, question.in_circles)) return *refusal;
    std::vector<std::string> spikes = std::move(of_machine.spikes);
    std::ranges::move(of_probe.spikes, std::back_inserter(spikes));
    ContourScan scan = reduce(std::move(of_machine), std::move(of_probe), question);
    scan.name = name;
    scan.spikes = std::move(spikes);
    scan.speed_mm_s = speed;
    for (const auto& other : scans) {
      if (other.distance.values != scan.distance.values || other.deflection.values != scan.deflection.values) continue;
      return Refusal{"duplicated-reading", other.name + " and " + name +
                                               " hold the same samples: a copied scan is not independent; remove it"};
    }
    if (auto refusal = unusable(scan, question)) return *refusal;
    scans.push_back(std::move(scan));
  }
  return scans;
}

Outcome<double, Refusal> coarseDelay(const std::vector<ContourScan>& scans, double window_s) {
  const double step = std::min(kTransition_s / 5.0, window_s / 10.0);
  const auto reach = static_cast<Index>(window_s / step);
  std::vector<Rates> rates;
  for (const auto& scan : scans) rates.push_back(ratesOf(scan, step));
  if (auto refusal = repeats(rates, reach, window_s)) return *refusal;
  // Minus the rate of the distance times the rate of the deflection a lag earlier.
  std::vector<double> sums(static_cast<std::size_t>(2 * reach + 1));
  for (const auto& scan : rates) {
    const Index n = scan.distance.size() - 2 * reach;
    for (Index lag = 0; n > 0 && lag <= 2 * reach; ++lag) {
      sums[static_cast<std::size_t>(lag)] -=
          scan.distance.segment(reach, n).dot(scan.deflection.segment(2 * reach - lag, n));
    }
  }
  const auto top = static_cast<std::size_t>(std::ranges::max_element(sums) - sums.begin());
  if (top == 0 || top + 1 == sums.size() || !(sums[top] > 0.0)) {
    return Refusal{"no-peak",
                   "no match of machine and probe was found within search_window_s; widen it, or check the records"};
  }
  const double rival = rivalOf(sums, top);
  if (rival > kRival * sums[top]) {
    return Refusal{
        "rival-peak",
        "another delay fits " + text(rival / sums[top]) +
            " times as well because the steps repeat; scan with arcs of different lengths, or narrow search_window_s"};
  }
  const double curvature = sums[top - 1] - 2.0 * sums[top] + sums[top + 1];
  const double fraction = 0.5 * (sums[top - 1] - sums[top + 1]) / curvature;
  return (static_cast<double>(top) - static_cast<double>(reach) + fraction) * step;
}

}  // namespace probebox::metrology
