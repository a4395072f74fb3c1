#include "tools/report/two_streams.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "firmware/metrology/scan/feature_distance.hpp"

namespace probebox::report {
namespace {

using metrology::Dataset;
using metrology::Table;
using Vector = std::array<double, 3>;

constexpr std::size_t kLeast = 10;  // samples

struct Samples {
  std::vector<double> times;
  std::vector<Vector> values;
};

Samples samplesOf(const Table& table, const char* id_column, double id, const std::array<const char*, 3>& columns) {
  Samples samples;
  const auto* ids = table.column(id_column);
  const auto* times = table.column("t_s");
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
  for (const auto column : metrology::kTouchesColumns) {
    if (touches->column(column) == nullptr) return std::nullopt;
  }
  const auto& speeds = *touches->column("speed_mm_s");
  const auto row = static_cast<std::size_t>(std::ranges::max_element(speeds) - speeds.begin());
  const double id = (*touches->column("touch"))[row];
  const Vector along{(*touches->column("ux"))[row], (*touches->column("uy"))[row], (*touches->column("uz"))[row]};
  const Samples body = samplesOf(machine, "touch", id, {"x_mm", "y_mm", "z_mm"});
  const Samples stylus = samplesOf(probe, "touch", id, {"a", "b", "c"});
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
  const auto* ids = machine.column("scan");
  if (!feature || ids == nullptr || ids->empty()) return std::nullopt;
  const double id = ids->front();
  const Samples body = samplesOf(machine, "scan", id, {"x_mm", "y_mm", "z_mm"});
  const Samples stylus = samplesOf(probe, "scan", id, {"a", "b", "c"});
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

}  // namespace

std::optional<TwoStreams> twoStreams(const Dataset& dataset) {
  const Table* machine = dataset.table("machine");
  const Table* probe = dataset.table("probe");
  if (machine == nullptr || probe == nullptr) return std::nullopt;
  return dataset.table("scans") != nullptr ? ofScan(dataset, *machine, *probe) : ofTouch(dataset, *machine, *probe);
}

std::optional<double> valueAt(const std::vector<double>& times, const std::vector<double>& values, double t) {
  const auto after = std::ranges::lower_bound(times, t);
  if (after == times.end() || (after == times.begin() && *after > t)) return std::nullopt;
  const auto k = static_cast<std::size_t>(after - times.begin());
  if (k == 0) return values[0];
  const double share = (t - times[k - 1]) / (times[k] - times[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}

}  // namespace probebox::report
