#include "firmware/metrology/touch/touch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <span>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/frozen_samples.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/kinematics/kinematics.hpp"

namespace probebox::metrology {
namespace {

using Grouped = std::map<double, Stream>;  // by touch

std::string nameOf(double id) {
  return "touch " + text(id);
}

// A table of samples by touch. `streams` comes with an empty stream for every touch that there is.
std::optional<Refusal> group(const Table& table, const ColumnNames& columns, Grouped& streams) {
  const auto& ids = *table.column(column::kTouch);
  std::map<double, std::vector<std::size_t>> rows;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (!streams.contains(ids[row])) {
      return Refusal{"unknown-touch", "table '" + table.name + "', row " + std::to_string(row + 1) + ": " +
                                          nameOf(ids[row]) + " is not in table 'touches'; add it there or omit it"};
    }
    rows[ids[row]].push_back(row);
  }
  for (const auto& [id, of_touch] : rows) streams[id] = streamOf(table, columns, of_touch);
  return std::nullopt;
}

// Stamps that jitter overtake each other, by less than half a period: such samples are good, in the order of their
// stamps. Others stay as they are.
void putInOrder(Stream& stream) {
  const auto& times = stream.times;
  std::vector<double> apart;
  double back = 0.0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    apart.push_back(times[k] - times[k - 1]);
    back = std::max(back, -apart.back());
  }
  if (!(back > 0.0) || back >= 0.5 * median(apart)) return;
  std::vector<Eigen::Index> order(times.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](Eigen::Index row) { return times[static_cast<std::size_t>(row)]; });
  stream.values = Rows3{stream.values(order, Eigen::all)};
  std::ranges::sort(stream.times);
}

std::optional<Refusal> wrongStamps(const Stream& stream, const std::string& table, const std::string& touch) {
  if (stream.times.empty()) {
    return Refusal{"missing-touch",
                   touch + " has no samples in table '" + table + "': the record is truncated; measure it again"};
  }
  for (std::size_t k = 1; k < stream.times.size(); ++k) {
    if (stream.times[k] > stream.times[k - 1]) continue;
    const std::string at = touch + " in table '" + table + "': ";
    if (std::find(stream.times.begin(), stream.times.begin() + static_cast<std::ptrdiff_t>(k), stream.times[k]) !=
        stream.times.begin() + static_cast<std::ptrdiff_t>(k)) {
      return Refusal{"duplicated-sample", at + "two samples at " + text(stream.times[k]) + " s; remove the duplicate"};
    }
    return Refusal{"time-not-rising", at + "the time decreases from " + text(stream.times[k - 1]) + " to " +
                                          text(stream.times[k]) + " s; give the samples in order of time"};
  }
  return std::nullopt;
}

// The streams of a touch are cut from one interval: when one ends far before the other, rows were lost.
std::optional<Refusal> differentTimes(const Touch& touch) {
  const auto& m = touch.machine.times;
  const auto& p = touch.probe.times;
  const double span = std::max(m.back(), p.back()) - std::min(m.front(), p.front());
  const double apart = std::max(std::abs(m.back() - p.back()), std::abs(m.front() - p.front()));
  const double allowed = std::max(0.2 * span, 6.0 * std::max(touch.machine.period(), touch.probe.period()));
  if (apart <= allowed) return std::nullopt;
  return Refusal{"truncated", touch.plan.name + ": machine covers " + text(m.front()) + " to " + text(m.back()) +
                                  " s, probe " + text(p.front()) + " to " + text(p.back()) +
                                  " s; samples are missing: measure it again"};
}

std::optional<Refusal> copied(const std::vector<Touch>& touches) {
  for (std::size_t i = 0; i < touches.size(); ++i) {
    for (std::size_t k = i + 1; k < touches.size(); ++k) {
      const auto& a = touches[i];
      const auto& b = touches[k];
      if (a.machine.times == b.machine.times && a.probe.times == b.probe.times &&
          a.machine.values == b.machine.values && a.probe.values == b.probe.values) {
        return Refusal{"duplicated-reading",
                       a.plan.name + " and " + b.plan.name +
                           " hold the same samples: a copied touch is not independent; remove it"};
      }
    }
  }
  return std::nullopt;
}

Outcome<Eigen::Vector3d, Refusal> unitVector(const Eigen::Vector3d& vector, const std::string& touch,
                                             const std::string& columns) {
  if (std::abs(vector.norm() - 1.0) > 1e-3) {
    return Refusal{"bad-direction",
                   touch + ": (" + columns + ") has the length " + text(vector.norm()) + ": it must be a unit vector"};
  }
  return Eigen::Vector3d{vector.normalized()};
}

Outcome<TouchPlan, Refusal> describe(const Table& touches, std::size_t row) {
  const auto cell = [&](std::string_view column) { return (*touches.column(column))[row]; };
  TouchPlan touch;
  touch.name = nameOf(cell(column::kTouch));
  TRY(const auto normal,
      unitVector({cell(column::kNormalX), cell(column::kNormalY), cell(column::kNormalZ)}, touch.name, "nx,ny,nz"));
  TRY(const auto retract,
      unitVector({cell(column::kAlongX), cell(column::kAlongY), cell(column::kAlongZ)}, touch.name, "ux,uy,uz"));
  touch.normal = normal;
  touch.retract = retract;
  if (touch.normal.dot(touch.retract) < 0.5) {
    return Refusal{"bad-direction", touch.name +
                                        ": the retract (ux,uy,uz) is more than 60 degrees off the outward normal "
                                        "(nx,ny,nz); touch along the normal"};
  }
  touch.speed_mm_s = cell(column::kSpeed);
  if (touch.speed_mm_s <= 0.0) {
    return Refusal{"bad-speed", touch.name + ": speed_mm_s is " + text(touch.speed_mm_s) +
                                    "; give the speed of the retract, greater than zero"};
  }
  return touch;
}

}  // namespace

double Stream::period() const {
  return times.size() < 2 ? 0.0 : (times.back() - times.front()) / static_cast<double>(times.size() - 1);
}

std::vector<double> Stream::along(const Eigen::Vector3d& direction, Run run) const {
  const Eigen::VectorXd projected = valuesOf(run) * direction;
  return {projected.begin(), projected.end()};
}

Stream streamOf(const Table& table, const ColumnNames& columns, std::span<const std::size_t> rows) {
  Stream stream;
  const auto& times = *table.column(columns[1]);
  for (const auto row : rows) stream.times.push_back(times[row]);
  stream.values.resize(static_cast<Eigen::Index>(rows.size()), 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto& values = *table.column(columns[static_cast<std::size_t>(k) + 2]);
    for (std::size_t at = 0; at < rows.size(); ++at) stream.values(static_cast<Eigen::Index>(at), k) = values[rows[at]];
  }
  return stream;
}

Outcome<std::vector<Touch>, Refusal> readTouches(const Dataset& dataset) {
  TRY(const auto listed, checkedTable(dataset, "touches", kTouchesColumns));
  TRY(const auto machine, checkedTable(dataset, "machine", kMachineColumns));
  TRY(const auto probe, checkedTable(dataset, "probe", kProbeColumns));
  if (auto refusal = frozenSamples(*probe, column::kTouch)) return *refusal;

  Grouped machine_streams;
  const auto& ids = *listed->column(column::kTouch);
  for (const double id : ids) {
    if (!machine_streams.try_emplace(id).second) {
      return Refusal{"duplicated-touch", nameOf(id) + " is listed twice in table 'touches': number every touch once"};
    }
  }
  Grouped probe_streams = machine_streams;
  if (auto refusal = group(*machine, kMachineColumns, machine_streams)) return *refusal;
  if (auto refusal = group(*probe, kProbeColumns, probe_streams)) return *refusal;

  std::vector<Touch> touches;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    TRY(const auto plan, describe(*listed, row));
    Touch touch{plan, std::move(machine_streams[ids[row]]), std::move(probe_streams[ids[row]])};
    putInOrder(touch.machine);
    putInOrder(touch.probe);
    if (auto refusal = wrongStamps(touch.machine, "machine", touch.plan.name)) return *refusal;
    if (auto refusal = wrongStamps(touch.probe, "probe", touch.plan.name)) return *refusal;
    if (auto refusal = differentTimes(touch)) return *refusal;
    touches.push_back(std::move(touch));
  }
  if (auto refusal = copied(touches)) return *refusal;
  return touches;
}

Outcome<std::vector<Touch>, Refusal> readJointTouches(const Dataset& dataset, const Kinematics& kinematics) {
  const auto names = kinematics.columns();
  std::vector<std::string_view> columns{kMachineColumns[0], kMachineColumns[1]};
  columns.insert(columns.end(), names.begin(), names.end());
  TRY(const auto recorded, checkedTable(dataset, "machine", columns));
  const auto& ids = *recorded->column(kMachineColumns[0]);
  const auto& times = *recorded->column(kMachineColumns[1]);
  const Eigen::MatrixXd joints = columnsOf(*recorded, names);
  Table tips = Table::withColumns("machine", kMachineColumns);
  std::map<std::string, std::vector<Eigen::Index>> rows;  // of each touch
  for (std::size_t row = 0; row < ids.size(); ++row) {
    const auto at = static_cast<Eigen::Index>(row);
    const auto tip = kinematics.reached(joints.row(at).transpose());
    if (!tip) {
      return Refusal{"not-reachable", "table 'machine', row " + std::to_string(row + 1) +
                                          ": the platform has no pose with these joint positions: compare the table "
                                          "'legs' with the machine"};
    }
    tips.append({ids[row], times[row], tip->x(), tip->y(), tip->z()});
    rows[nameOf(ids[row])].push_back(at);
  }
  Dataset cartesian = dataset;
  std::ranges::replace_if(
      cartesian.tables, [](const Table& table) { return table.name == "machine"; }, tips);
  auto touches = readTouches(cartesian);
  if (!touches) return touches;
  for (auto& touch : touches.value()) {
    auto& of_touch = rows[touch.plan.name];
    // As the samples of the tip are.
    std::ranges::stable_sort(of_touch, {}, [&](Eigen::Index row) { return times[static_cast<std::size_t>(row)]; });
    touch.joints = joints(of_touch, Eigen::all);
  }
  return touches;
}

}  // namespace probebox::metrology
