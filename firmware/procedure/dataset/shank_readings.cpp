#include "firmware/procedure/dataset/shank_readings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;
using metrology::Table;

// More than any shank is off its nominal radius.
constexpr double kRadiusTolerance_mm = 0.1;
constexpr double kSameSide = 0.99;  // cosine

double sigmaOf(const std::vector<ShankReading>& touches) {
  double sum = 0;
  for (const auto& touch : touches) sum += touch.sd_mm * touch.sd_mm;
  return std::sqrt(sum / static_cast<double>(touches.size()));
}

// Ball and shank together: the mean over those poses whose sides are opposed, where the place of the ball cancels.
std::optional<double> effectiveRadius(const std::vector<ShankReading>& touches) {
  double sum = 0, count = 0;
  for (const auto& first : touches) {
    Vector3d sides = Vector3d::Zero();
    for (const auto& touch : touches) {
      if (touch.number == first.number) sides += touch.side;
    }
    if (sides.norm() > 1e-3) continue;
    sum += first.side.dot(first.at_mm);
    ++count;
  }
  return count > 0 ? std::optional{sum / count} : std::nullopt;
}

std::optional<metrology::Refusal> wrongRadius(double effective_mm, const std::vector<Reading>& readings,
                                              const Facts& facts) {
  double of_tip_mm = 0;
  for (const auto& reading : readings) of_tip_mm += reading.centre.radius_mm / static_cast<double>(readings.size());
  const double radius_mm = effective_mm - (of_tip_mm - facts.stylus_ball_diameter_mm / 2);
  if (std::abs(radius_mm - facts.probe_shank->radius_mm) <= kRadiusTolerance_mm) return std::nullopt;
  return metrology::Refusal{
      "shank-radius-wrong",
      "the shank is measured with a radius of " + std::to_string(radius_mm) + " mm, and " +
          std::to_string(facts.probe_shank->radius_mm) +
          " is stated: check [probe_shank] radius_mm and height_mm, and the stylus ball's diameter"};
}

// How far from the middle of its side a touch was made, across the tool: the touches of the sides to either hand tell
// where the middle is.
double besideMiddle(const std::vector<ShankReading>& all, const ShankReading& touch, double radius_mm) {
  double sum = 0, count = 0;
  Vector3d towards;
  for (const auto& other : all) {
    if (other.number != touch.number || std::abs(other.side.dot(touch.side)) > 0.5) continue;
    if (count == 0) towards = other.side;
    const double sense = other.side.dot(towards) > 0 ? 1 : -1;
    sum += sense * (other.side.dot(touch.at_mm - other.at_mm) + radius_mm);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// The touches from one side at one stop of B.
struct ShankStop {
  double b_rad{};
  Vector3d side;
  Vector3d sum{Vector3d::Zero()};
  double touches{};
};

std::vector<ShankStop> stopsOf(const std::vector<ShankReading>& touches) {
  std::vector<ShankStop> stops;
  for (const auto& touch : touches) {
    auto stop = std::ranges::find_if(stops, [&](const ShankStop& s) {
      return std::abs(s.b_rad - touch.b_rad) < kSameStop_rad && s.side.dot(touch.side) > kSameSide;
    });
    if (stop == stops.end()) stop = stops.insert(stops.end(), {.b_rad = touch.b_rad, .side = touch.side});
    stop->sum += touch.at_mm;
    ++stop->touches;
  }
  // Half a turn of A has to be between two: one alone shows the run-out of the shank.
  std::erase_if(stops, [](const ShankStop& stop) { return stop.touches < 2; });
  return stops;
}

}  // namespace

std::optional<metrology::Refusal> centreTouches(std::vector<ShankReading>& touches,
                                                const std::vector<Reading>& readings, const Facts& facts) {
  if (touches.empty()) return std::nullopt;
  if (!facts.probe_shank)
    return metrology::Refusal{"no-shank",
                              "the run uses a shank, but none is described: give [probe_shank] in machine.toml"};
  const auto radius_mm = effectiveRadius(touches);
  if (!radius_mm || readings.empty()) return std::nullopt;
  if (auto refusal = wrongRadius(*radius_mm, readings, facts)) return refusal;
  const auto as_measured = touches;
  for (auto& touch : touches) {
    const double beside_mm = besideMiddle(as_measured, touch, *radius_mm);
    const double nearer_mm = *radius_mm - std::sqrt(std::max(*radius_mm * *radius_mm - beside_mm * beside_mm, 0.0));
    touch.at_mm += nearer_mm * touch.side;
  }
  return std::nullopt;
}

void addShankOfAlignment(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts) {
  auto table = metrology::emptyTable(metrology::kAAxisAlignment, "shank", {metrology::column::kStop});
  for (const auto& touch : touches) {
    table.append({facts.probe_shank->length_mm(), touch.a_rad, touch.c_rad, touch.at_mm.x(), touch.at_mm.y(),
                  touch.side.x(), touch.side.y(), touch.stop});
  }
  dataset.config["sigma_shank_mm"] = sigmaOf(touches);
  dataset.tables.insert(dataset.tables.begin() + 1, std::move(table));
}

void addShankOfSwivel(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts) {
  const double length_mm = facts.probe_shank->length_mm();
  const HeadFacts head = facts.swivel_head.value_or(HeadFacts{});
  auto table = metrology::emptyTable(metrology::kSwivelError, "shank");
  auto& queries = *std::ranges::find(dataset.tables, "queries", &Table::name);
  double queried_rad = 0;
  for (const auto& stop : stopsOf(touches)) {
    const Vector3d at = stop.sum / stop.touches + nominalTip(head, stop.b_rad, length_mm);
    table.append({degrees(stop.b_rad), length_mm, at.x(), at.y(), at.z(), stop.side.x(), stop.side.y(), stop.side.z()});
    if (std::abs(stop.b_rad) < kPoseTolerance_rad || std::abs(stop.b_rad - queried_rad) < kSameStop_rad) continue;
    queries.append({degrees(stop.b_rad), length_mm});
    queried_rad = stop.b_rad;
  }
  dataset.config["sigma_shank_mm"] = sigmaOf(touches) / std::numbers::sqrt2;
  dataset.tables.insert(dataset.tables.begin() + 2, std::move(table));
}

}  // namespace probebox::procedure
