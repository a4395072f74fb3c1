#include "firmware/procedure/dataset/b_tables.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "firmware/metrology/tilt/swivel_lengths.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;

std::vector<double> listOf(const std::array<double, 3>& v) {
  return {v.begin(), v.end()};
}

// Root mean square over the coordinates across the axis, of all readings.
double sigmaAcross(const std::vector<Reading>& readings, const Vector3d& axis) {
  double sum = 0;
  for (const auto& reading : readings) sum += axis.cross(reading.centre.sd_mm).squaredNorm() / 2;
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// `other`: the angle that tells points apart.
void addPoints(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BFacts& b,
               double Reading::*other, const metrology::Method& method) {
  const Vector3d axis = vectorOf(b.axis);
  dataset.config["sigma_mm"] = sigmaAcross(readings, axis);
  if (b.sigma_rad > 0) dataset.config["sigma_angle_rad"] = b.sigma_rad;
  auto rows = metrology::emptyTable(method, "readings");
  for (const auto& reading : readings) {
    const auto& at = reading.centre.centre_mm;
    rows.append({degrees(reading.b_rad), halfTurns_deg(reading.*other), at.x(), at.y(), at.z()});
  }
  rows.columns.push_back(timesOf(readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(rows));
}

// The readings with one tool at one stop of B.
struct Stop {
  double b_rad{};
  double length_mm{};
  std::uint32_t tool{};
  std::vector<const Reading*> readings{};

  double time_s() const {
    double sum = 0;
    for (const auto* reading : readings) sum += reading->time_s;
    return sum / static_cast<double>(readings.size());
  }
  Vector3d meanOf(Vector3d metrology::BallCentre::*part) const {
    Vector3d sum = Vector3d::Zero();
    for (const auto* reading : readings) sum += reading->centre.*part;
    return sum / static_cast<double>(readings.size());
  }
};

std::vector<Stop> stopsOf(const std::vector<Reading>& readings, const Facts& facts) {
  std::vector<Stop> stops;
  for (const auto& reading : readings) {
    if (stops.empty() || stops.back().tool != reading.tool ||
        std::abs(stops.back().b_rad - reading.b_rad) > kSameStop_rad)
      stops.push_back({.b_rad = reading.b_rad, .length_mm = facts.lengthOf(reading.tool), .tool = reading.tool});
    stops.back().readings.push_back(&reading);
  }
  return stops;
}

// Standard deviation of one coordinate of a mean, root mean square over all.
double sigmaOf(const std::vector<Stop>& stops) {
  double sum = 0;
  for (const auto& stop : stops) {
    const auto n = static_cast<double>(stop.readings.size());
    for (const auto* reading : stop.readings) sum += reading->centre.sd_mm.squaredNorm() / (3 * n * n);
  }
  return std::sqrt(sum / static_cast<double>(stops.size()));
}

// Numbered as metrology numbers the tools of a swivel: by their lengths, in the order of the rows.
void addLengthSds(metrology::Dataset& dataset, const std::vector<Stop>& stops, const Facts& facts) {
  static_assert(kMostProbeTools == metrology::kLengthsOfSwivel.size());
  std::vector<double> lengths, sds;
  for (const auto& stop : stops) {
    const double sd_mm = facts.sdOfLength(stop.tool);
    const auto found = std::ranges::find(lengths, stop.length_mm);
    if (found == lengths.end()) {
      lengths.push_back(stop.length_mm);
      sds.push_back(sd_mm);
    } else {
      auto& sd = sds.at(static_cast<std::size_t>(found - lengths.begin()));
      sd = std::max(sd, sd_mm);
    }
  }
  for (std::size_t i = 0; i < sds.size(); ++i) {
    if (sds[i] > 0) dataset.config[std::string{metrology::kLengthsOfSwivel.at(i).sd_key}] = sds[i];
  }
}

}  // namespace

Vector3d nominalTip(const HeadFacts& head, double b_rad, double length_mm) {
  const Vector3d pivot = vectorOf(head.pivot_mm);
  return pivot + Eigen::AngleAxisd{b_rad, vectorOf(head.b.axis)} * (Vector3d{0, 0, -length_mm} - pivot);
}

void addTilts(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BFacts& table) {
  addPoints(dataset, readings, table, &Reading::c_rad, metrology::kTablePivot);
  dataset.config["tilt_axis"] = listOf(table.axis);
}

void addSwivels(metrology::Dataset& dataset, const std::vector<Reading>& readings, const HeadFacts& head) {
  addPoints(dataset, readings, head.b, &Reading::a_rad, metrology::kHeadPivot);
  dataset.config["swivel_axis"] = listOf(head.b.axis);
  if (!head.ball_mm) return;
  dataset.config["ball_mm"] = listOf(*head.ball_mm);
  if (head.sd_ball_mm) dataset.config["sd_ball_mm"] = *head.sd_ball_mm;
}

void addLengthResults(metrology::Dataset& dataset, const Facts& facts, const std::vector<std::uint32_t>& probe_tools) {
  static_assert(kMostProbeTools == metrology::key::kLengthResults.size());
  for (std::size_t i = 0; i < probe_tools.size(); ++i) {
    const std::uint64_t result = facts.lengthResultOf(probe_tools[i]);
    const auto& key = metrology::key::kLengthResults.at(i);
    if (result != 0) dataset.config[std::string{key.name}] = static_cast<double>(result);
  }
}

std::vector<std::uint32_t> toolsOf(const std::vector<Reading>& readings) {
  std::vector<std::uint32_t> tools;
  for (const auto& reading : readings) {
    if (std::ranges::find(tools, reading.tool) == tools.end()) tools.push_back(reading.tool);
  }
  return tools;
}

void addSwivelErrors(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts) {
  const HeadFacts head = facts.swivel_head.value_or(HeadFacts{});
  const auto stops = stopsOf(readings, facts);
  dataset.config["swivel_axis"] = listOf(head.b.axis);
  dataset.config["sigma_mm"] = sigmaOf(stops);
  if (head.b.sigma_rad > 0) {
    dataset.config["sigma_angle_rad"] = head.b.sigma_rad;
    dataset.config["pivot_mm"] = listOf(head.pivot_mm);
  }
  addLengthResults(dataset, facts, toolsOf(readings));
  addLengthSds(dataset, stops, facts);
  auto rows = metrology::emptyTable(metrology::kSwivelError, "readings");
  auto queries = metrology::emptyTable(metrology::kSwivelError, "queries");
  std::vector<Reading> of_stops;
  for (const auto& stop : stops) {
    of_stops.push_back(*stop.readings.front());
    of_stops.back().time_s = stop.time_s();
    const Vector3d at = stop.meanOf(&metrology::BallCentre::centre_mm) + nominalTip(head, stop.b_rad, stop.length_mm);
    rows.append({degrees(stop.b_rad), stop.length_mm, at.x(), at.y(), at.z()});
    // Errors are told against B = 0, where they are none.
    if (std::abs(stop.b_rad) > kPoseTolerance_rad) queries.append({degrees(stop.b_rad), stop.length_mm});
  }
  rows.columns.push_back(timesOf(of_stops));
  dataset.tables.insert(dataset.tables.begin(), {std::move(rows), std::move(queries)});
}

}  // namespace probebox::procedure
