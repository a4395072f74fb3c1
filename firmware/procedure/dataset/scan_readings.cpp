#include "firmware/procedure/dataset/scan_readings.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/scan/scan_gain.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kIterations = 10;

// Distance of a commanded path from the middle, where it has turned by so much.
double radiusAt(const ScanPath& path, double reach_mm, double turned_rad) {
  double from_mm = reach_mm - path.depths_mm[0], behind_rad = 0;
  for (std::size_t i = 0; i < waysOf(path); ++i) {
    const ScanWay way = wayOf(path, i);
    const double turn_rad = std::abs(way.turn_rad), to_mm = reach_mm - way.to_depth_mm;
    const double within_rad = std::clamp(turned_rad - behind_rad, 0.0, turn_rad);
    if (turned_rad <= behind_rad + turn_rad || i + 1 == waysOf(path)) {
      if (way.is_arc) return to_mm;
      // A straight line in polar coordinates.
      return from_mm * to_mm * std::sin(turn_rad) /
             (from_mm * std::sin(within_rad) + to_mm * std::sin(turn_rad - within_rad));
    }
    behind_rad += turn_rad;
    from_mm = to_mm;
  }
  return from_mm;
}

// From the start of the path on; a little less than nothing counts as that.
double turnedBy(const ScanPath& path, const Vector3d& from_centre) {
  constexpr double kBefore_rad = 0.1;
  const double turned_rad = path.sense * (std::atan2(from_centre.y(), from_centre.x()) - path.start_rad);
  return turned_rad - kTurn * std::floor((turned_rad + kBefore_rad) / kTurn);
}

// Middle of the commanded paths of all scans, mm: where the control takes the middle of the ball to be. machine: table
// scan, t_s, x_mm, y_mm, z_mm. reach_mm: of the stylus ball from the middle of the ball at contact. The mean of the
// positions where the machine hardly moved.
Vector3d scanCentre(const metrology::Table& machine, const capture::Recording& recording, double reach_mm) {
  const auto column = [&](std::size_t i) -> const std::vector<double>& { return machine.columns[i].values; };
  const std::size_t rows = machine.rows();
  if (rows == 0) return Vector3d::Zero();
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < rows; ++i)
    mean += Vector3d{column(2)[i], column(3)[i], column(4)[i]} / static_cast<double>(rows);
  const ScanPath& first = recording.touches().front().request.scan;
  const double begin_mm = reach_mm - first.depths_mm[0];
  Vector3d centre{column(2)[0] - begin_mm * std::cos(first.start_rad),
                  column(3)[0] - begin_mm * std::sin(first.start_rad), mean.z()};
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix3d normal = Matrix3d::Zero();  // of the middle in the plane, and of the radius
    Vector3d right = Vector3d::Zero();
    for (const auto& scan : recording.touches()) {
      for (std::size_t i = 0; i < rows; ++i) {
        if (column(0)[i] != scan.request.step) continue;
        const Vector3d off = Vector3d{column(2)[i], column(3)[i], mean.z()} - centre;
        const double radius_mm = off.norm();
        if (!(radius_mm > 0)) continue;
        const Vector3d row{off.x() / radius_mm, off.y() / radius_mm, 1};
        const double wanted_mm = radiusAt(scan.request.scan, reach_mm, turnedBy(scan.request.scan, off));
        normal += row * row.transpose();
        right += row * (radius_mm - wanted_mm);
      }
    }
    const auto step = metrology::solutionIfInvertible(normal, right);
    if (!step || !(step->head<2>().norm() < reach_mm)) return mean;
    centre.head<2>() += step->head<2>();
  }
  return centre;
}

using metrology::Table;

constexpr double kSearchWindow_s = 0.05;  // no chain of encoders and control is later than that

// Travel from the ends of the path that is left out: the stylus still sticks there.
constexpr double kEnds_mm = 0.5;

struct Rows {
  std::vector<double> times;
  std::vector<Vector3d> values;
};

Rows rowsOf(const Table& table, double number) {
  Rows rows;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.columns[0].values[row] != number) continue;
    rows.times.push_back(table.columns[1].values[row]);
    rows.values.emplace_back(table.columns[2].values[row], table.columns[3].values[row], table.columns[4].values[row]);
  }
  return rows;
}

// From when on and until when the machine is off the ends of its path; all of it where it did not move.
std::pair<double, double> onTheWay(const Rows& machine) {
  const auto off = [](const Vector3d& end) {
    return [end](const Vector3d& at) { return (at - end).norm() > kEnds_mm; };
  };
  const auto& at = machine.values;
  const auto first = std::ranges::find_if(at, off(at.front()));
  const auto last = std::find_if(at.rbegin(), at.rend(), off(at.back()));
  if (first == at.end() || last == at.rend()) return {machine.times.front(), machine.times.back()};
  return {machine.times[static_cast<std::size_t>(first - at.begin())],
          machine.times[static_cast<std::size_t>(at.rend() - last) - 1]};
}

void append(Table& table, double number, const Rows& rows, const std::pair<double, double>& within) {
  for (std::size_t i = 0; i < rows.times.size(); ++i) {
    const double t = rows.times[i];
    if (t < within.first || t > within.second) continue;
    table.append({number, t, rows.values[i].x(), rows.values[i].y(), rows.values[i].z()});
  }
}

Eigen::Matrix3d describedGain(const Facts& facts) {
  Eigen::Matrix3d gain;
  for (std::size_t row = 0; row < 3; ++row)
    gain.row(static_cast<Eigen::Index>(row)) = Eigen::RowVector3d{facts.gain[row].data()};
  return gain;
}

metrology::Matrix matrixOf(const Eigen::Matrix3d& matrix) {
  metrology::Matrix rows;
  for (const auto& row : matrix.rowwise()) rows.emplace_back(row.begin(), row.end());
  return rows;
}

}  // namespace

RunDataset scanDataset(const FinishedRun& run) {
  const auto all = capture::touchDataset(run.recording, run.scales, std::string{run.method.name()});
  auto machine = Table::withColumns("machine", metrology::kScanMachineColumns),
       probe = Table::withColumns("probe", metrology::kScanProbeColumns),
       scans = Table::withColumns("scans", metrology::kScansColumns);
  for (const auto& scan : run.recording.touches()) {
    const double number = scan.request.step;
    const Rows positions = rowsOf(all.tables[0], number);
    if (positions.times.empty()) continue;
    const auto within = onTheWay(positions);
    append(machine, number, positions, within);
    append(probe, number, rowsOf(all.tables[1], number), within);
    scans.append({number, scan.request.retract_speed_mm_s});
  }
  RunDataset built{{.method = std::string{run.method.name()}, .config = {}, .tables = {}}, {}, {}};
  auto& dataset = built.dataset;
  dataset.tables = {std::move(machine), std::move(probe), std::move(scans)};
  const Vector3d centre = scanCentre(dataset.tables[0], run.recording, run.facts.sphereReach_mm().value_or(0));
  const Eigen::Matrix3d described = describedGain(run.facts);
  const auto gain = metrology::scanGain(dataset, centre, described);
  dataset.config["centre_mm"] = std::vector<double>{centre.x(), centre.y(), centre.z()};
  dataset.config["gain_matrix"] = matrixOf(gain.value_or(described));
  dataset.config["search_window_s"] = kSearchWindow_s;
  addProbePose(dataset, run.recording);
  return built;
}

}  // namespace probebox::procedure
