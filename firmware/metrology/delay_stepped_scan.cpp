#include "firmware/metrology/delay_stepped_scan.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/previous_delay.hpp"
#include "firmware/metrology/waveform_match.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 5> kMachineScan{"scan", "t_s", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 5> kProbeScan{"scan", "t_s", "a", "b", "c"};
constexpr std::array<std::string_view, 2> kScans{"scan", "speed_mm_s"};
constexpr std::array<std::string_view, 9> kKeys{
    "centre_mm", "search_window_s", "gain_matrix",           "effective_radius_mm", "r1_mm",
    "r2_mm",     "arcs_rad",        "centre_is_approximate", "previous_tau_s"};
constexpr double kTransition_s = 0.020;  // of a step of the radius
constexpr double kCentreError_mm = 0.2;
constexpr double kRival = 0.6;
constexpr double kLeastRate = 10.0;  // squares of the rate against those of its noise
constexpr double kDroppedShare = 0.10;
constexpr std::size_t kLeastSamples = 50;

// Local cubic over nine samples, a period apart (Savitzky and Golay): value and rate of the middle one.
constexpr std::array<double, 9> kSmooth{-21 / 231., 14 / 231., 39 / 231., 54 / 231., 59 / 231.,
                                        54 / 231.,  39 / 231., 14 / 231., -21 / 231.};
constexpr std::array<double, 9> kRate{86 / 1188.,  -142 / 1188., -193 / 1188., -126 / 1188., 0.,
                                      126 / 1188., 193 / 1188.,  142 / 1188.,  -86 / 1188.};

struct Scan {
  std::string name;
  double speed_mm_s{};
  Signal radius;               // mm, machine from the stated centre
  Signal deflection;           // mm
  std::vector<double> angle;   // at the machine's stamps, rad
  std::vector<double> smooth;  // radius, smoothed
  std::vector<double> rate;    // mm/s
};

struct Config {
  Vector3d centre;
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};
  double window_s{};
};

Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset) {
  const auto entry = dataset.config.find("gain_matrix");
  if (entry == dataset.config.end()) return Eigen::Matrix3d{Eigen::Matrix3d::Identity()};
  const auto* rows = std::get_if<Matrix>(&entry->second);
  const auto three = [](const std::vector<double>& row) { return row.size() == 3; };
  if (!rows || rows->size() != 3 || !std::ranges::all_of(*rows, three)) {
    return Refusal{"bad-config", "config key 'gain_matrix' must be three rows of three numbers"};
  }
  Eigen::Matrix3d gain;
  for (Eigen::Index i = 0; i < 3; ++i)
    gain.row(i) = Eigen::RowVector3d::Map((*rows)[static_cast<std::size_t>(i)].data());
  return gain;
}

Outcome<Config, Refusal> readConfig(const Dataset& dataset) {
  const auto centre = configVector(dataset, "centre_mm");
  if (!centre) return centre.error();
  if (!centre.value()) return Refusal{"bad-config", "method " + dataset.method + " needs the config key 'centre_mm'"};
  const auto window = requiredPositive(dataset, "search_window_s");
  if (!window) return window.error();
  if (window.value() < kTransition_s) {
    return Refusal{"window-too-small", "search_window_s is " + text(window.value()) +
                                           " s: a step of the radius takes 0.02 s; give at least that"};
  }
  const auto gain = configGain(dataset);
  if (!gain) return gain.error();
  return Config{Vector3d::Map((*centre)->data()), gain.value(), window.value()};
}

// Rows of one scan as points on their stamps.
struct Points {
  std::vector<double> times;
  std::vector<Vector3d> values;
};

Points pointsOf(const Table& table, std::span<const std::string_view> columns, double id) {
  const auto& ids = *table.column("scan");
  const auto& times = *table.column("t_s");
  const auto& x = *table.column(columns[2]);
  const auto& y = *table.column(columns[3]);
  const auto& z = *table.column(columns[4]);
  Points points;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (ids[row] != id) continue;
    points.times.push_back(times[row]);
    points.values.emplace_back(x[row], y[row], z[row]);
  }
  return points;
}

std::optional<Refusal> wrongStamps(const Points& points, const std::string& scan, const std::string& table) {
  if (points.times.size() < kLeastSamples) {
    return Refusal{"too-few-samples", scan + " has " + std::to_string(points.times.size()) + " samples in table '" +
                                          table + "', fifty are needed; record it again"};
  }
  if (std::ranges::is_sorted(points.times, std::ranges::less_equal{})) return std::nullopt;
  return Refusal{"time-not-rising", scan + " in table '" + table +
                                        "': the stamps do not rise; give every sample once, "
                                        "in the order of time"};
}

// A filter over nine samples; the ends keep the nearest whole one.
std::vector<double> filtered(const std::vector<double>& values, const std::array<double, 9>& weights) {
  std::vector<double> result(values.size());
  for (std::size_t k = 4; k + 4 < values.size(); ++k) {
    for (std::size_t i = 0; i < weights.size(); ++i) result[k] += weights[i] * values[k + i - 4];
  }
  std::fill_n(result.begin(), 4, result[4]);
  std::fill_n(result.end() - 4, 4, result[values.size() - 5]);
  return result;
}

Scan reduce(const Points& machine, const Points& probe, const Config& config) {
  Scan scan;
  scan.radius.times = machine.times;
  scan.deflection.times = probe.times;
  for (const auto& at : machine.values) {
    const Vector3d arm = at - config.centre;
    scan.radius.values.push_back(arm.norm());
    scan.angle.push_back(std::atan2(arm.y(), arm.x()));
  }
  for (const auto& d : probe.values) scan.deflection.values.push_back((config.gain * d).norm());
  scan.smooth = filtered(scan.radius.values, kSmooth);
  scan.rate = filtered(scan.radius.values, kRate);
  for (double& rate : scan.rate) rate /= scan.radius.period();
  return scan;
}

std::optional<Refusal> unusable(const Scan& scan, const Config& config) {
  const double sigma = std::sqrt(sampleVariance(scan.deflection));
  if (*std::ranges::min_element(scan.deflection.values) < 5.0 * sigma + 1e-6) {
    return Refusal{"contact-lost", scan.name + ": the deflection falls to zero; scan with a larger deflection"};
  }
  double squares = 0.0;
  for (const double rate : scan.rate) squares += rate * rate;
  double noise = 0.0;
  for (const double weight : kRate) noise += weight * weight;
  noise *= sampleVariance(scan.radius) / std::pow(scan.radius.period(), 2) * static_cast<double>(scan.rate.size());
  if (squares < kLeastRate * noise + 1e-12) {
    return Refusal{"constant-radius", scan.name + ": the radius does not change; scan with steps of the radius"};
  }
  const double turn_s = 2.0 * std::numbers::pi * scan.smooth.front() / scan.speed_mm_s;
  if (config.window_s >= 0.5 * turn_s) {
    return Refusal{"window-too-large", "search_window_s is " + text(config.window_s) + " s and " + scan.name +
                                           " repeats after " + text(turn_s) + " s; give less than half of that"};
  }
  return std::nullopt;
}

Outcome<std::vector<Scan>, Refusal> readScans(const Dataset& dataset, const Config& config) {
  const auto listed = checkedTable(dataset, "scans", kScans);
  if (!listed) return listed.error();
  const auto machine = checkedTable(dataset, "machine", kMachineScan);
  if (!machine) return machine.error();
  const auto probe = checkedTable(dataset, "probe", kProbeScan);
  if (!probe) return probe.error();
  const auto& ids = *listed.value()->column("scan");
  for (const auto* table : {machine.value(), probe.value()}) {
    for (const double id : *table->column("scan")) {
      if (std::ranges::count(ids, id) == 1) continue;
      return Refusal{"unknown-scan", "scan " + text(id) + " of table '" + table->name +
                                         "' does not stand once in table 'scans'; correct it there"};
    }
  }
  std::vector<Scan> scans;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    const std::string name = "scan " + text(ids[row]);
    const double speed = (*listed.value()->column("speed_mm_s"))[row];
    if (speed <= 0.0) return Refusal{"bad-speed", name + ": speed_mm_s must be greater than zero"};
    const Points of_machine = pointsOf(*machine.value(), kMachineScan, ids[row]);
    const Points of_probe = pointsOf(*probe.value(), kProbeScan, ids[row]);
    if (auto refusal = wrongStamps(of_machine, name, "machine")) return *refusal;
    if (auto refusal = wrongStamps(of_probe, name, "probe")) return *refusal;
    Scan scan = reduce(of_machine, of_probe, config);
    scan.name = name;
    scan.speed_mm_s = speed;
    if (auto refusal = unusable(scan, config)) return *refusal;
    scans.push_back(std::move(scan));
  }
  return scans;
}

// Values at times that rise, by lines between the samples; the ends beyond them.
class Between {
 public:
  Between(const std::vector<double>& times, const std::vector<double>& values) : times_{times}, values_{values} {}
  double at(double t) {
    while (cursor_ > 0 && times_[cursor_] > t) --cursor_;
    while (cursor_ + 2 < times_.size() && times_[cursor_ + 1] <= t) ++cursor_;
    const double share = (t - times_[cursor_]) / (times_[cursor_ + 1] - times_[cursor_]);
    return values_[cursor_] + std::clamp(share, 0.0, 1.0) * (values_[cursor_ + 1] - values_[cursor_]);
  }

 private:
  const std::vector<double>& times_;
  const std::vector<double>& values_;
  std::size_t cursor_{};
};

// Sum over all scans of minus the rate of the radius times the rate of the deflection, lag by lag (A13).
std::vector<double> correlation(const std::vector<Scan>& scans, double step, std::size_t reach) {
  std::vector<double> sums(2 * reach + 1);
  for (const auto& scan : scans) {
    std::vector<double> deflection_rate = filtered(scan.deflection.values, kRate);
    Between radius{scan.radius.times, scan.rate};
    Between deflection{scan.deflection.times, deflection_rate};
    const double from = std::max(scan.radius.times.front(), scan.deflection.times.front());
    const double until = std::min(scan.radius.times.back(), scan.deflection.times.back());
    std::vector<double> r;
    std::vector<double> d;
    for (double t = from; t <= until; t += step) {
      r.push_back(radius.at(t));
      d.push_back(deflection.at(t) / scan.deflection.period());
    }
    for (std::size_t lag = 0; lag < sums.size(); ++lag) {
      for (std::size_t k = reach; k + reach < r.size(); ++k) sums[lag] -= r[k] * d[k + reach - lag];
    }
  }
  return sums;
}

// The lag of the highest peak, refined by a parabola through the three topmost values.
Outcome<double, Refusal> coarseDelay(const std::vector<Scan>& scans, double window_s) {
  double step = window_s / 50.0;
  for (const auto& scan : scans) step = std::max(step, scan.deflection.period());
  const auto reach = static_cast<std::size_t>(window_s / step);
  const auto sums = correlation(scans, step, reach);
  const auto top = static_cast<std::size_t>(std::ranges::max_element(sums) - sums.begin());
  if (top == 0 || top + 1 == sums.size() || !(sums[top] > 0.0)) {
    return Refusal{"no-peak", "machine and probe do not match within search_window_s; widen it, or check the records"};
  }
  std::size_t left = top;
  std::size_t right = top;
  while (left > 0 && sums[left - 1] < sums[left]) --left;
  while (right + 1 < sums.size() && sums[right + 1] < sums[right]) ++right;
  double rival = 0.0;
  for (std::size_t lag = 0; lag < sums.size(); ++lag) {
    if (lag < left || lag > right) rival = std::max(rival, sums[lag]);
  }
  if (rival > kRival * sums[top]) {
    return Refusal{"rival-peak", "another delay fits " + text(rival / sums[top]) +
                                     " times as well: the steps repeat; scan with arcs of different lengths, or narrow "
                                     "search_window_s"};
  }
  const double curvature = sums[top - 1] - 2.0 * sums[top] + sums[top + 1];
  const double fraction = 0.5 * (sums[top - 1] - sums[top + 1]) / curvature;
  return (static_cast<double>(top) - static_cast<double>(reach) + fraction) * step;
}

// How far the stated centre is off, from r + delta = R + ex cos + ey sin.
std::optional<Refusal> wrongCentre(const Scan& scan, double tau) {
  Between deflection{scan.deflection.times, scan.deflection.values};
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (std::size_t k = 0; k < scan.angle.size(); ++k) {
    const Vector3d row{1.0, std::cos(scan.angle[k]), std::sin(scan.angle[k])};
    normal += row * row.transpose();
    right += row * (scan.radius.values[k] + deflection.at(scan.radius.times[k] - tau));
  }
  const Vector3d solution = normal.fullPivLu().solve(right);
  const double off_mm = solution.tail<2>().norm();
  if (off_mm <= kCentreError_mm) return std::nullopt;
  return Refusal{"centre-error", scan.name + ": the stated centre is off by " + text(off_mm) +
                                     " mm, 0.2 mm are allowed; measure the sphere's centre again"};
}

void skipGaps(SeenTwice& record, const Signal& signal, double shift) {
  const double period = signal.period();
  for (std::size_t k = 1; k < signal.times.size(); ++k) {
    if (signal.times[k] - signal.times[k - 1] <= kGapPeriods * period) continue;
    record.skipped.emplace_back(signal.times[k - 1] + shift - period, signal.times[k] + shift + period);
  }
}

SeenTwice seenTwice(const Scan& scan, double tau) {
  SeenTwice record;
  record.name = scan.name;
  record.machine = scan.radius;
  record.probe = scan.deflection;
  const double margin = 4.0 * std::max(scan.radius.period(), scan.deflection.period());
  record.from = std::max(scan.radius.times.front(), scan.deflection.times.front() + tau) + margin;
  record.until = std::min(scan.radius.times.back(), scan.deflection.times.back() + tau) - margin;
  std::vector<double> cosine;
  std::vector<double> sine;
  for (const double angle : scan.angle) {
    cosine.push_back(std::cos(angle));
    sine.push_back(std::sin(angle));
  }
  const double mean = scan.smooth[scan.smooth.size() / 2];
  record.shapes = [rate = Between{scan.radius.times, scan.rate}, radius = Between{scan.radius.times, scan.smooth}, mean,
                   cosine = std::move(cosine), sine = std::move(sine), &times = scan.radius.times,
                   cursor = std::size_t{0}](double t) mutable {
    while (cursor > 0 && times[cursor] > t) --cursor;
    while (cursor + 2 < times.size() && times[cursor + 1] <= t) ++cursor;
    const double share = (t - times[cursor]) / (times[cursor + 1] - times[cursor]);
    const auto mixed = [&](const std::vector<double>& v) { return v[cursor] + share * (v[cursor + 1] - v[cursor]); };
    Eigen::VectorXd shapes{5};
    shapes << rate.at(t), mean - radius.at(t), 1.0, mixed(cosine), mixed(sine);
    return shapes;
  };
  skipGaps(record, scan.radius, 0.0);
  skipGaps(record, scan.deflection, tau);
  return record;
}

}  // namespace

Outcome<Result, Refusal> solveDelaySteppedScan(const Dataset& dataset) {
  const auto config = readConfig(dataset);
  if (!config) return config.error();
  const auto previous = previousDelay(dataset, 1);
  if (!previous) return previous.error();
  const auto scans = readScans(dataset, config.value());
  if (!scans) return scans.error();
  const auto start = coarseDelay(scans.value(), config->window_s);
  if (!start) return start.error();
  std::vector<SeenTwice> records;
  for (const auto& scan : scans.value()) {
    if (auto refusal = wrongCentre(scan, start.value())) return *refusal;
    records.push_back(seenTwice(scan, start.value()));
  }
  const auto match = matchWaveforms(records, start.value(), Interpolation::cubic);
  if (!match) return match.error();
  if (auto bad = poorMatch(match.value(), kDroppedShare)) return *bad;
  return reportMatch(dataset, match.value(), previous.value(), kKeys);
}

}  // namespace probebox::metrology
