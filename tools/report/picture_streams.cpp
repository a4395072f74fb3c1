#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/scan/feature_distance.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

// One touch or scan of a case as two signals against time: position of the machine and deflection of the probe.
struct TwoStreams {
  std::string name;  // "touch 7"
  std::vector<double> machine_s;
  std::vector<double> machine_mm;  // along the retract, or from the scanned feature (from the centre of a sphere)
  std::vector<double> probe_s;
  std::vector<double> probe;  // in the probe's units, positive in contact
  double axis_share[3]{};     // squared components of the direction: weight of each axis' delay
  bool whole_contact{};       // a touch, whose contact begins and ends within the data
};

namespace column = metrology::column;
using metrology::Dataset;
using metrology::Table;
using Vector = std::array<double, 3>;

constexpr std::size_t kLeast = 10;  // samples

struct Samples {
  std::vector<double> times;
  std::vector<Vector> values;
};

Samples samplesOf(const Table& table, std::string_view id_column, double id,
                  std::span<const metrology::MethodColumn, 3> columns) {
  Samples samples;
  const auto* ids = table.column(id_column);
  const auto* times = table.column(column::kTime);
  std::array<const std::vector<double>*, 3> parts{};
  for (std::size_t k = 0; k < 3; ++k) parts[k] = table.column(columns[k]);
  if (ids == nullptr || times == nullptr || !table.rectangular()) return samples;
  if (std::ranges::find(parts, nullptr) != parts.end()) return samples;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Vector value{(*parts[0])[row], (*parts[1])[row], (*parts[2])[row]};
    const bool finite =
        std::isfinite((*times)[row]) && std::ranges::all_of(value, [](double v) { return std::isfinite(v); });
    if ((*ids)[row] != id || !finite) continue;
    if (!samples.times.empty() && (*times)[row] <= samples.times.back()) continue;
    samples.times.push_back((*times)[row]);
    samples.values.push_back(value);
  }
  return samples;
}

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Sum of the larger half of the deflections, as a unit vector: the direction in which the probe gives way.
Vector directionOf(const std::vector<Vector>& deflections) {
  double largest = 0.0;
  for (const auto& d : deflections) largest = std::max(largest, dot(d, d));
  Vector sum{};
  for (const auto& d : deflections) {
    for (std::size_t k = 0; dot(d, d) > 0.25 * largest && k < 3; ++k) sum[k] += d[k];
  }
  const double length = std::sqrt(dot(sum, sum));
  for (double& part : sum) part = length > 0.0 ? part / length : 0.0;
  return sum;
}

std::optional<Vector> vectorOf(const Dataset& dataset, const char* key) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return std::nullopt;
  const auto* list = std::get_if<std::vector<double>>(&entry->second);
  if (list == nullptr || list->size() != 3) return std::nullopt;
  return Vector{(*list)[0], (*list)[1], (*list)[2]};
}

// A d with the gain matrix of the case, or d itself.
Vector throughGain(const Dataset& dataset, const Vector& d) {
  const auto entry = dataset.config.find("gain_matrix");
  const auto* rows = entry == dataset.config.end() ? nullptr : std::get_if<metrology::Matrix>(&entry->second);
  if (rows == nullptr || rows->size() != 3) return d;
  Vector product{};
  for (std::size_t k = 0; k < 3; ++k) {
    if ((*rows)[k].size() != 3) return d;
    product[k] = dot({(*rows)[k][0], (*rows)[k][1], (*rows)[k][2]}, d);
  }
  return product;
}

std::optional<TwoStreams> ofTouch(const Dataset& dataset, const Table& machine, const Table& probe) {
  const Table* touches = dataset.table("touches");
  if (touches == nullptr || !touches->rectangular() || touches->rows() == 0) return std::nullopt;
  for (const auto& needed : metrology::kTouchesColumns) {
    if (touches->column(needed) == nullptr) return std::nullopt;
  }
  const auto& speeds = *touches->column(column::kSpeed);
  const auto row = static_cast<std::size_t>(std::ranges::max_element(speeds) - speeds.begin());
  const double id = (*touches->column(column::kTouch))[row];
  const Vector along{(*touches->column(column::kAlongX))[row], (*touches->column(column::kAlongY))[row],
                     (*touches->column(column::kAlongZ))[row]};
  const Samples body = samplesOf(machine, column::kTouch, id, column::kPosition);
  const Samples stylus = samplesOf(probe, column::kTouch, id, column::kChannels);
  if (body.times.size() < kLeast || stylus.times.size() < kLeast) return std::nullopt;
  TwoStreams streams{.name = "touch " + std::to_string(static_cast<long long>(id)),
                     .machine_s = body.times,
                     .machine_mm = {},
                     .probe_s = stylus.times,
                     .probe = {},
                     .axis_share = {},
                     .whole_contact = true};
  const Vector direction = directionOf(stylus.values);
  for (const auto& at : body.values) streams.machine_mm.push_back(dot(at, along));
  for (const auto& d : stylus.values) streams.probe.push_back(dot(d, direction));
  for (std::size_t k = 0; k < 3; ++k) streams.axis_share[k] = along[k] * along[k];
  return streams;
}

// Feature along which a scan was made: the one that the case names, or a sphere.
std::optional<metrology::FeatureDistance> scannedFeature(const Dataset& dataset) {
  if (dataset.config.contains("shape")) {
    const auto feature = metrology::featureDistance(dataset);
    return feature ? std::optional{feature.value()} : std::nullopt;
  }
  const auto centre = vectorOf(dataset, "centre_mm");
  if (!centre) return std::nullopt;
  return metrology::FeatureDistance{.centre = Eigen::Vector3d{centre->data()}};
}

std::optional<TwoStreams> ofScan(const Dataset& dataset, const Table& machine, const Table& probe) {
  const auto feature = scannedFeature(dataset);
  const auto* ids = machine.column(column::kScan);
  if (!feature || ids == nullptr || ids->empty()) return std::nullopt;
  const double id = ids->front();
  const Samples body = samplesOf(machine, column::kScan, id, column::kPosition);
  const Samples stylus = samplesOf(probe, column::kScan, id, column::kChannels);
  if (body.times.size() < kLeast || stylus.times.size() < kLeast) return std::nullopt;
  TwoStreams streams{.name = "scan " + std::to_string(static_cast<long long>(id)),
                     .machine_s = body.times,
                     .machine_mm = {},
                     .probe_s = stylus.times,
                     .probe = {},
                     .axis_share = {1.0 / 3, 1.0 / 3, 1.0 / 3},
                     .whole_contact = false};
  for (const auto& at : body.values) streams.machine_mm.push_back(feature->at(Eigen::Vector3d{at.data()}).mm);
  for (const auto& d : stylus.values) {
    const Vector deflection = throughGain(dataset, d);
    streams.probe.push_back(std::sqrt(dot(deflection, deflection)));
  }
  return streams;
}

// Takes the fastest touch or the first scan; nothing if the tables are missing or too short.
std::optional<TwoStreams> twoStreams(const Dataset& dataset) {
  const Table* machine = dataset.table("machine");
  const Table* probe = dataset.table("probe");
  if (machine == nullptr || probe == nullptr) return std::nullopt;
  return dataset.table("scans") != nullptr ? ofScan(dataset, *machine, *probe) : ofTouch(dataset, *machine, *probe);
}

// Interpolates linearly between samples; nothing outside them.
std::optional<double> valueAt(const std::vector<double>& times, const std::vector<double>& values, double t) {
  const auto after = std::ranges::lower_bound(times, t);
  if (after == times.end() || (after == times.begin() && *after > t)) return std::nullopt;
  const auto k = static_cast<std::size_t>(after - times.begin());
  if (k == 0) return values[0];
  const double share = (t - times[k - 1]) / (times[k] - times[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}

namespace quantity = metrology::quantity;

constexpr double kInContact = 0.05;      // of the largest deflection
constexpr double kBesideContact = 0.15;  // of its length, that is shown before and after
constexpr double kAroundStep_s = 0.08;

// The probe as the machine would be where the tip sticks: offset - gain * deflection.
struct Likeness {
  double gain{};
  double offset{};
};

struct Window {
  double from{};
  double until{};
};

// By how much the machine's stamps are still late: a previous delay is out of them already.
double delayAlong(const TwoStreams& streams, const metrology::Result& result) {
  const auto left = [&](std::string_view key) {
    const auto* residual = result.find("residual_" + std::string{key});
    return residual != nullptr ? residual : result.find(key);
  };
  if (const auto* tau = left(quantity::kTau.key)) return tau->value();
  const auto* axes = left(quantity::kTauAxis.key);
  double tau = 0.0;
  for (std::size_t k = 0; axes != nullptr && k < std::min<std::size_t>(3, axes->values.size()); ++k) {
    tau += streams.axis_share[k] * axes->values[k];
  }
  return tau;
}

// In the window alone: around a whole scan the middle of the sphere that is a little off bends one of the two.
std::optional<Likeness> likenessOf(const TwoStreams& streams, double tau, const Window& window) {
  const double limit = streams.whole_contact ? kInContact * *std::ranges::max_element(streams.probe) : -1.0;
  double n = 0.0;
  double sd = 0.0;
  double sq = 0.0;
  double sdd = 0.0;
  double sdq = 0.0;
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    const auto q = valueAt(streams.machine_s, streams.machine_mm, streams.probe_s[k] + tau);
    const double d = streams.probe[k];
    if (!q || d < limit || streams.probe_s[k] < window.from || streams.probe_s[k] > window.until) continue;
    n += 1.0, sd += d, sq += *q, sdd += d * d, sdq += d * *q;
  }
  const double determinant = n * sdd - sd * sd;
  if (n < 3.0 || !(determinant > 0.0)) return std::nullopt;
  const double slope = (n * sdq - sd * sq) / determinant;
  return Likeness{-slope, (sq - slope * sd) / n};
}

// The contact with something beside it; of a scan what lies around its steepest step.
Window windowOf(const TwoStreams& streams) {
  if (!streams.whole_contact) {
    std::size_t steepest = 1;
    for (std::size_t k = 1; k < streams.machine_mm.size(); ++k) {
      const auto step = [&](std::size_t at) { return std::abs(streams.machine_mm[at] - streams.machine_mm[at - 1]); };
      if (step(k) > step(steepest)) steepest = k;
    }
    const double middle = streams.machine_s[steepest];
    return {middle - kAroundStep_s, middle + kAroundStep_s};
  }
  const double limit = kInContact * *std::ranges::max_element(streams.probe);
  Window window{streams.probe_s.back(), streams.probe_s.front()};
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    if (streams.probe[k] < limit) continue;
    window.from = std::min(window.from, streams.probe_s[k]);
    window.until = std::max(window.until, streams.probe_s[k]);
  }
  const double beside = kBesideContact * (window.until - window.from);
  return {window.from - beside, window.until + beside};
}

// Both streams against time from the start of the window; `taken_out` is subtracted from the machine's stamps.
Plot drawn(const TwoStreams& streams, const Window& window, const Likeness& likeness, double taken_out,
           const std::string& title) {
  const bool touch = streams.whole_contact;
  Plot plot{title + ", " + streams.name, "time (ms)", touch ? "along the retract (mm)" : "radius (mm)"};
  const double level = touch ? likeness.offset : 0.0;
  std::vector<Point> machine;
  for (std::size_t k = 0; k < streams.machine_s.size(); ++k) {
    const double t = streams.machine_s[k] - taken_out;
    if (t >= window.from && t <= window.until)
      machine.push_back({1e3 * (t - window.from), streams.machine_mm[k] - level});
  }
  std::vector<Point> probe;
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    const double t = streams.probe_s[k];
    const double seen = likeness.offset - likeness.gain * streams.probe[k] - level;
    if (t >= window.from && t <= window.until) probe.push_back({1e3 * (t - window.from), seen});
  }
  plot.add(std::move(machine), Look::solid, "machine");
  plot.add(std::move(probe), Look::dashed, "probe, times its gain and turned over");
  return plot;
}

}  // namespace

std::vector<Plot> streamPictures(const metrology::Dataset& dataset, const metrology::Result& result) {
  const auto streams = twoStreams(dataset);
  if (!streams || (result.find(quantity::kTau.key) == nullptr && result.find(quantity::kTauAxis.key) == nullptr))
    return {};
  const double tau = delayAlong(*streams, result);
  const Window window = windowOf(*streams);
  const auto likeness = likenessOf(*streams, tau, window);
  if (!likeness) return {};
  return {drawn(*streams, window, *likeness, 0.0, "As stamped"),
          drawn(*streams, window, *likeness, tau, "Delay taken out")};
}

std::vector<Plot> rawStreamPictures(const metrology::Dataset& dataset) {
  const auto streams = twoStreams(dataset);
  if (!streams) return {};
  const double start = std::min(streams->machine_s.front(), streams->probe_s.front());
  Plot machine{"Machine as stamped, " + streams->name, "time (ms)", "along the retract (mm)"};
  Plot probe{"Probe as stamped, " + streams->name, "time (ms)", "deflection (units of the probe)"};
  std::vector<Point> of_machine;
  std::vector<Point> of_probe;
  for (std::size_t k = 0; k < streams->machine_s.size(); ++k) {
    of_machine.push_back({1e3 * (streams->machine_s[k] - start), streams->machine_mm[k]});
  }
  for (std::size_t k = 0; k < streams->probe_s.size(); ++k) {
    of_probe.push_back({1e3 * (streams->probe_s[k] - start), streams->probe[k]});
  }
  machine.add(std::move(of_machine), Look::solid);
  probe.add(std::move(of_probe), Look::dashed);
  return {machine, probe};
}

}  // namespace probebox::report
