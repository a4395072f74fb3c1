#include "firmware/procedure/dataset/switched_readings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/pre_travel_shifts.hpp"
#include "firmware/metrology/touch/pre_travel.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

using metrology::Table;

constexpr double kNothing = 1e-12;  // mm: rounding

// From the machine's axes into the probe's.
Eigen::Quaterniond intoProbe(const capture::TouchRequest& touch, const Facts& facts) {
  const auto& [a_rad, b_rad, c_rad] = touch.rotary_angles_rad;
  Eigen::Quaterniond turned{Eigen::AngleAxisd{a_rad, Eigen::Vector3d::UnitZ()}};
  if (touch.swivels && facts.swivel_head)
    turned = Eigen::AngleAxisd{b_rad, vectorOf(facts.swivel_head->b.axis)} * turned;
  return turned.conjugate();
}

bool byShank(const capture::TouchRequest& touch) {
  return touch.shank_height_mm > 0;
}

// The columns that differ; nothing where none does.
Table differenceOf(const Table& shifted, const Table& from, const std::string& name) {
  Table difference{.name = name, .columns = {}};
  for (const auto& column : from.columns) {
    const auto* values = shifted.column(column.name);
    if (values == nullptr || values->size() != column.values.size()) continue;
    metrology::Column by{.name = column.name, .values = *values};
    double most = 0;
    for (std::size_t row = 0; row < by.values.size(); ++row) {
      by.values[row] -= column.values[row];
      most = std::max(most, std::abs(by.values[row]));
    }
    if (most > kNothing) difference.columns.push_back(std::move(by));
  }
  return difference;
}

}  // namespace

bool readsBySwitch(const FinishedRun& run) {
  const auto touches = run.recording.touches();
  return !touches.empty() && touches.front().request.by_edges &&
         touches.front().request.switch_of == capture::SwitchOf::probe;
}

Outcome<std::vector<PreTravel>, metrology::Refusal> preTravelsOf(const FinishedRun& run) {
  std::vector<PreTravel> found;
  for (const auto& touch : run.recording.touches()) {
    const std::uint32_t tool = touch.request.tool;
    const bool known = std::ranges::find(found, tool, &PreTravel::tool) != found.end();
    if (known || byShank(touch.request)) continue;
    const auto* in_force = run.facts.preTravelOf(tool);
    if (in_force == nullptr) {
      return metrology::Refusal{
          "no-pre-travel", "no pre-travel of the touch-trigger probe" +
                               (tool == 0 ? "" : " in tool " + std::to_string(tool)) +
                               " is in force any more, so its touches are displaced from the surface by an unknown "
                               "distance: calibrate it (" +
                               preTravelCommand(tool) + "), accept it, and measure again"};
    }
    found.push_back(*in_force);
    found.back().tool = tool;
  }
  return found;
}

void addPreTravelResults(metrology::Dataset& dataset, const std::vector<PreTravel>& pre_travels) {
  static_assert(kMostProbeTools == metrology::key::kPreTravelResults.size());
  for (std::size_t i = 0; i < pre_travels.size(); ++i) {
    const auto key = pre_travels[i].tool == 0 ? "pre_travel_result" : metrology::key::kPreTravelResults.at(i).name;
    dataset.config[std::string{key}] = static_cast<double>(pre_travels[i].result_id);
  }
}

std::vector<metrology::SwitchedTouch> withoutPreTravel(std::vector<metrology::SwitchedTouch> touches,
                                                       const FinishedRun& run, std::uint32_t tool,
                                                       const Eigen::Vector4d& parts_mm) {
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto& request = run.recording.touches()[i].request;
    if (request.tool != tool || byShank(request)) continue;
    auto& touch = touches[i];
    const Eigen::Vector3d n = intoProbe(request, run.facts) * touch.normal;
    touch.at_mm += metrology::preTravelParts(n).dot(parts_mm) * touch.normal;
  }
  return touches;
}

// Cholesky; a part that is known exactly is no cause.
Eigen::Matrix4d causesOf(const PreTravel& pre_travel) {
  Eigen::Matrix4d lower = Eigen::Matrix4d::Zero();
  for (Eigen::Index row = 0; row < 4; ++row) {
    const auto& covariance = pre_travel.covariance[static_cast<std::size_t>(row)];
    for (Eigen::Index column = 0; column <= row; ++column) {
      const double rest = covariance[static_cast<std::size_t>(column)] -
                          lower.row(row).head(column).dot(lower.row(column).head(column));
      if (row == column)
        lower(row, row) = std::sqrt(std::max(rest, 0.0));
      else if (lower(column, column) > 0)
        lower(row, column) = rest / lower(column, column);
    }
  }
  return lower;
}

void addShifts(metrology::Dataset& dataset, const metrology::Dataset& shifted, std::string_view suffix) {
  std::vector<Table> differences;
  for (const auto& table : shifted.tables) {
    const auto* from = dataset.table(table.name);
    if (from == nullptr) continue;
    auto difference = differenceOf(table, *from, table.name + std::string{suffix});
    if (!difference.columns.empty()) differences.push_back(std::move(difference));
  }
  for (auto& difference : differences) dataset.tables.push_back(std::move(difference));
}

}  // namespace probebox::procedure
