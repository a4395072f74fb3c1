#include "firmware/procedure/dataset/shift_touches.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/joint/joint.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "firmware/metrology/screw/screw_config.hpp"
#include "firmware/metrology/touch/ball_centre.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/stop_shifts.hpp"

namespace probebox::procedure {
namespace {

// Growth of the screw at the nut that positions were corrected by, mm: mean over a touch.
double growthOf(const capture::Recording& recording, const capture::Touch& touch, std::size_t axis) {
  const auto rows = recording.machineRows(touch);
  double sum_nm = 0;
  for (const auto& row : rows) sum_nm += row.screw_nm[axis];
  return 1e-6 * sum_nm / static_cast<double>(rows.size());
}

// One axis in all touches: positions and extensions, in the order of the rows.
struct AxisOfShift {
  std::vector<double> growth_mm, extension_um;
  bool is_fitted{};  // its gain
};

AxisOfShift axisOf(const FinishedRun& run, const std::vector<metrology::LoneTouch>& touches, std::size_t axis) {
  AxisOfShift found;
  const auto& screw = run.facts.screws[axis];
  if (!screw || screw->gain == 0) return found;
  const metrology::ScrewModel model{*screw, 1};
  for (const auto& touch : touches) {
    const double growth_mm = growthOf(run.recording, run.recording.touches()[touch.touch], axis);
    const double at_mm = touch.at_mm[static_cast<Eigen::Index>(axis)] + growth_mm;
    found.growth_mm.push_back(growth_mm);
    // What positions are corrected by is the negative of what the gain of an error predicts.
    found.extension_um.push_back(-1e3 * growth_mm / (screw->gain * metrology::leverOf(model, at_mm)));
  }
  const auto [least, most] = std::ranges::minmax(found.extension_um);
  found.is_fitted = most - least >= metrology::kLeastExtension_um;
  return found;
}

// Normals where the ball was met: a drive that passes its middle by 0.1 mm meets it 0.3 um lower. By the ball through
// the touches of each reading, whose speeds and delay move it along its radii.
std::vector<Eigen::Vector3d> normalsOf(const FinishedRun& run, const std::vector<metrology::LoneTouch>& touches) {
  const auto requestOf = [&](const metrology::LoneTouch& touch) -> const capture::TouchRequest& {
    return run.recording.touches()[touch.touch].request;
  };
  std::map<std::uint32_t, std::vector<Eigen::Vector3d>> readings;
  for (const auto& touch : touches) readings[requestOf(touch).reading].push_back(touch.at_mm);
  std::map<std::uint32_t, metrology::Ball> balls;
  for (const auto& [reading, points] : readings) {
    Eigen::MatrixX3d rows{std::ssize(points), 3};
    for (Eigen::Index row = 0; row < rows.rows(); ++row)
      rows.row(row) = points[static_cast<std::size_t>(row)].transpose();
    if (auto ball = metrology::algebraicBall(rows)) balls.emplace(reading, *std::move(ball));
  }
  std::vector<Eigen::Vector3d> normals;
  for (const auto& touch : touches) {
    const auto& request = requestOf(touch);
    const auto ball = balls.find(request.reading);
    normals.push_back(ball == balls.end() ? vectorOf(request.outward_normal)
                                          : Eigen::Vector3d{(touch.at_mm - ball->second.centre).normalized()});
  }
  return normals;
}

void describeScrew(metrology::Dataset& dataset, const ScrewFacts& screw, std::size_t axis) {
  const auto key = [&](const char* of) { return of + std::string(1, "xyz"[axis]); };
  dataset.config[key("screw_length_") + "_mm"] = screw.length_mm;
  dataset.config[key("orgoff_") + "_mm"] = screw.offset_mm;
  dataset.config[key("gain_")] = screw.gain;
  if (screw.reversed) dataset.config[key("axis_reversed_")] = true;
}

void addShift(metrology::Dataset& dataset, const FinishedRun& run, const std::vector<metrology::LoneTouch>& touches) {
  std::array<AxisOfShift, kLinearAxes> axes;
  std::vector<std::string_view> extensions;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    axes[axis] = axisOf(run, touches, axis);
    if (!axes[axis].is_fitted) continue;
    describeScrew(dataset, *run.facts.screws[axis], axis);
    extensions.push_back(metrology::kExtensions[axis].name);
  }
  auto table = metrology::emptyTable(metrology::kJoint, "readings", extensions);
  const auto normals = normalsOf(run, touches);
  for (std::size_t row = 0; row < touches.size(); ++row) {
    const auto& recorded = run.recording.touches()[touches[row].touch];
    const Eigen::Vector3d& normal = normals[row];
    Eigen::Vector3d at_mm = touches[row].at_mm;
    std::vector<double> cells{timeOf(run.recording, recorded), static_cast<double>(recorded.request.ball),
                              recorded.request.rotary_angles_rad[2]};
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
      if (axes[axis].is_fitted) at_mm[static_cast<Eigen::Index>(axis)] += axes[axis].growth_mm[row];
    cells.insert(cells.end(), normal.begin(), normal.end());
    cells.push_back(normal.dot(touches[row].velocity_mm_s));
    cells.insert(cells.end(), at_mm.begin(), at_mm.end());
    for (const auto& axis : axes)
      if (axis.is_fitted) cells.push_back(axis.extension_um[row]);
    for (std::size_t column = 0; column < cells.size(); ++column) table.columns[column].values.push_back(cells[column]);
  }
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

// What one sd of the stops of table and head moves each row by.
void addStops(metrology::Dataset& dataset, const FinishedRun& run, const std::vector<metrology::LoneTouch>& touches) {
  std::vector<metrology::Table> moved;
  for (const auto& touch : touches) {
    const auto tool = run.recording.touches()[touch.touch].request.tool;
    std::size_t table = 0;
    for (const auto& [axis, stylus_mm] : movedByStops(run, touch.at_mm, tool)) {
      if (table == moved.size())
        moved.push_back(
            metrology::Table::withColumns("readings" + std::string{axis.suffix}, metrology::column::kPosition));
      moved[table++].append({-stylus_mm.x(), -stylus_mm.y(), -stylus_mm.z()});
    }
  }
  std::ranges::move(moved, std::back_inserter(dataset.tables));
}

// Of a touch, and of a stop of C.
void addSigmasOfTouches(metrology::Dataset& dataset, const std::vector<metrology::LoneTouch>& touches,
                        const Facts& facts) {
  double squares = 0;
  for (const auto& touch : touches) squares += touch.sd_mm * touch.sd_mm;
  dataset.config["sigma_mm"] = std::sqrt(squares / static_cast<double>(touches.size()));
  if (facts.sigma_c_rad > 0) dataset.config["sigma_C_rad"] = facts.sigma_c_rad;
}

}  // namespace

RunDataset shiftDataset(const FinishedRun& run) {
  RunDataset built{touchesOf(run), {}, {}};
  const std::vector<std::size_t> alone(run.recording.touches().size(), metrology::kAlone);
  const auto points = metrology::ballCentres(built.dataset, alone, {});
  if (points) {
    addShift(built.dataset, run, points->alone);
    addStops(built.dataset, run, points->alone);
    addSigmasOfTouches(built.dataset, points->alone, run.facts);
    built.warnings = unplacedStops(run, run.recording.touches().front().request.tool);
    if (auto warning = droppedTouches(points->dropped)) built.warnings.push_back(*std::move(warning));
  } else {
    built.refusal = points.error();
  }
  return built;
}

}  // namespace probebox::procedure
