#include "firmware/procedure/dataset/scan_readings.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/scan/scan_gain.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/scan_centre.hpp"
#include "firmware/procedure/plan/live_method.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;
using metrology::Table;

constexpr double kSearchWindow_s = 0.05;  // no chain of encoders and control is later than that

// Travel from the ends of the path that is left out: the stylus still sticks there.
constexpr double kEnds_mm = 0.5;

constexpr std::array<std::string_view, 5> kMachineScan{"scan", "t_s", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 5> kProbeScan{"scan", "t_s", "a", "b", "c"};
constexpr std::array<std::string_view, 2> kScans{"scan", "speed_mm_s"};

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
  auto machine = Table::withColumns("machine", kMachineScan), probe = Table::withColumns("probe", kProbeScan),
       scans = Table::withColumns("scans", kScans);
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
