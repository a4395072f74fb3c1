#include <cmath>
#include <cstddef>

#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_compensation.hpp"
#include "firmware/metrology/screw/screw_config.hpp"
#include "tools/report/names.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;
namespace column = metrology::column;

using metrology::Dataset;

const std::vector<double>* columnOf(const Dataset& dataset, const char* table, std::string_view column) {
  const auto* found = dataset.table(table);
  return found == nullptr || !found->rectangular() ? nullptr : found->column(column);
}

std::vector<Point> pairs(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<Point> points;
  for (std::size_t k = 0; k < x.size() && k < y.size(); ++k) points.push_back({x[k], y[k]});
  return points;
}

// The sensor over time with its drift, in a slow rotation or at rest.
void addSensor(std::vector<Plot>& all, const Dataset& dataset, const char* table, const char* title,
               const metrology::Result& result) {
  const auto* time = columnOf(dataset, table, column::kTime);
  const auto* sensor = columnOf(dataset, table, column::kSensor);
  if (time != nullptr && sensor != nullptr && !time->empty()) {
    Plot plot{title, "time (s)", "sensor (um)"};
    plot.add(pairs(*time, *sensor), Look::solid, "sensor: extension and face");
    if (const auto* drift = result.find(quantity::kSensorDrift.key)) {
      double mean_t = 0.0;
      double mean_s = 0.0;
      for (std::size_t k = 0; k < time->size(); ++k) {
        mean_t += (*time)[k] / static_cast<double>(time->size());
        mean_s += (*sensor)[k] / static_cast<double>(time->size());
      }
      const auto on_line = [&](double t) { return Point{t, mean_s + drift->value() * (t - mean_t)}; };
      plot.add({on_line(time->front()), on_line(time->back())}, Look::dashed, "drift: what the screw itself does");
    }
    all.push_back(plot);
  }
}

void addSectors(std::vector<Plot>& all, const metrology::Result& result) {
  const auto* table = result.find(quantity::kSectorTable.key);
  if (table == nullptr) return;
  Plot plot{"Table of sectors, bars of U", "sector", "face above its mean (um)"};
  std::vector<Point> points;
  std::vector<double> bars;
  for (std::size_t k = 0; k < table->values.size(); ++k) {
    points.push_back({static_cast<double>(k + 1), table->values[k]});
    bars.push_back(2.0 * combinedOf(*table, k).value_or(0.0));
  }
  plot.addWithBars(std::move(points), bars, Look::dots);
  plot.addLevel(0.0);
  all.push_back(plot);
}

void addGain(std::vector<Plot>& all, const Dataset& dataset, const metrology::Result& result) {
  const auto* extension = columnOf(dataset, "gain_cal", metrology::kExtension);
  const auto* error = columnOf(dataset, "gain_cal", metrology::kNutError);
  const auto* position = columnOf(dataset, "gain_cal", column::kX);
  const auto* gain = result.find(quantity::kScrewGain.key);
  const auto length = dataset.config.find("screw_length_mm");
  const auto offset = dataset.config.find("orgoff_mm");
  if (!extension || !error || !position || !gain || length == dataset.config.end() || offset == dataset.config.end())
    return;
  if (!std::holds_alternative<double>(length->second) || !std::holds_alternative<double>(offset->second)) return;
  const auto reversed = dataset.config.find("axis_reversed");
  const bool turned = reversed != dataset.config.end() && reversed->second == metrology::Value{true};
  std::vector<Point> points;
  double furthest = 0.0;
  for (std::size_t k = 0; k < extension->size(); ++k) {
    const double way =
        turned ? (*position)[k] - std::get<double>(offset->second) : (*position)[k] + std::get<double>(offset->second);
    points.push_back({way / std::get<double>(length->second) * (*extension)[k], (*error)[k]});
    furthest = std::abs(points.back().x) > std::abs(furthest) ? points.back().x : furthest;
  }
  Plot plot{"Gain", "share of the extension at the nut (um)", "true error (um)"};
  plot.add({{0.0, 0.0}, {furthest, gain->value() * furthest}}, Look::solid, "fitted: the slope is K");
  plot.add(std::move(points), Look::dots, "measured");
  all.push_back(plot);
}

void addCompensation(std::vector<Plot>& all, const Dataset& dataset, const metrology::Result& result) {
  const auto* sensor = columnOf(dataset, "cycle", column::kSensor);
  const auto* compensation = result.find(quantity::kScrewCorrections.key);
  if (compensation == nullptr) return;
  Plot plot{"Compensation over the cycle", "row of the cycle, in the order of time", "um"};
  std::vector<Point> points;
  for (std::size_t k = 0; k < compensation->values.size(); ++k) {
    points.push_back({static_cast<double>(k + 1), compensation->values[k]});
  }
  plot.add(std::move(points), Look::solid, "compensation");
  if (sensor != nullptr) {
    std::vector<Point> readings;
    for (std::size_t k = 0; k < sensor->size(); ++k) readings.push_back({static_cast<double>(k + 1), (*sensor)[k]});
    plot.add(std::move(readings), Look::dashed, "sensor: extension and face");
  }
  all.push_back(plot);
}

}  // namespace

std::vector<Plot> screwPictures(const Subject& subject) {
  std::vector<Plot> all;
  const auto& result = *subject.result();
  if (subject.dataset) {
    addSensor(all, *subject.dataset, "sector_cal", "Sensor in time, slow rotation", result);
    addSensor(all, *subject.dataset, "at_rest", "Sensor in time, at rest", result);
    addCompensation(all, *subject.dataset, result);
    addGain(all, *subject.dataset, result);
  } else {
    addCompensation(all, {}, result);
  }
  addSectors(all, result);
  return all;
}

}  // namespace probebox::report
