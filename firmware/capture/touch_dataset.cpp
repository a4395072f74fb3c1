#include "firmware/capture/touch_dataset.hpp"

#include <algorithm>
#include <utility>

#include "firmware/metrology/touch/switched_touch.hpp"

namespace probebox::capture {
namespace {

constexpr double kMillimetresPerNanometre = 1e-6;

// Stamps of one touch as seconds of the master clock from its origin on.
struct Seconds {
  MonoTime origin;
  double rate;
  double operator()(MonoTime at) const { return static_cast<double>((at - origin).count()) * rate; }
};

void appendMachine(metrology::Table& machine, const Recording& recording, const Touch& touch, const Scales& scales,
                   const Seconds& seconds) {
  for (const MachineRow& row : recording.machineRows(touch)) {
    const auto& [x, y, z] = position_mm(row, scales, recording.offset_mm());
    machine.append({static_cast<double>(touch.request.step), seconds(row.at), x, y, z});
  }
}

void appendRequest(metrology::Table& touches, const TouchRequest& request) {
  const auto& n = request.outward_normal;
  const auto& u = request.retract_direction;
  touches.append({static_cast<double>(request.step), n[0], n[1], n[2], u[0], u[1], u[2], request.retract_speed_mm_s});
}

}  // namespace

std::array<double, kLinearAxes> position_mm(const MachineRow& row, const Scales& scales,
                                            const std::array<double, kLinearAxes>& offset_mm) {
  std::array<double, kLinearAxes> at_mm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    at_mm[axis] = static_cast<double>(row.counts[axis]) * scales.mm_per_count[axis] + offset_mm[axis] -
                  row.screw_nm[axis] * kMillimetresPerNanometre;
  }
  return at_mm;
}

double masterSecondsPerNs(const TickMap& map, Nanoseconds nominal_period) {
  constexpr double kTwoToThe32 = 4294967296.0;
  const double period_ns = static_cast<double>(map.period_q32_ns) / kTwoToThe32;
  return static_cast<double>(nominal_period.count()) / period_ns * 1e-9;
}

metrology::Dataset touchDataset(const Recording& recording, const Scales& scales, std::string method) {
  metrology::Dataset dataset = metrology::touchDataset(std::move(method));
  metrology::Table& machine = dataset.tables[0];
  metrology::Table& probe = dataset.tables[1];
  metrology::Table& touches = dataset.tables[2];
  for (const Touch& touch : recording.touches()) {
    const auto machine_rows = recording.machineRows(touch);
    const auto probe_rows = recording.probeRows(touch);
    const Seconds seconds{std::min(machine_rows.front().at, probe_rows.front().at),
                          masterSecondsPerNs(touch.map, scales.nominal_period)};
    const double number = touch.request.step;
    appendMachine(machine, recording, touch, scales, seconds);
    for (const ProbeRow& row : probe_rows) {
      const auto channel = [&row](std::size_t i) { return row.channels_nm[i] * kMillimetresPerNanometre; };
      probe.append({number, seconds(row.at), channel(0), channel(1), channel(2)});
    }
    appendRequest(touches, touch.request);
  }
  return dataset;
}

metrology::Dataset edgeDataset(const Recording& recording, const Scales& scales, std::string method) {
  auto machine = metrology::Table::withColumns("machine", metrology::kMachineColumns);
  auto touches = metrology::Table::withColumns("touches", metrology::kTouchesColumns);
  auto edges = metrology::Table::withColumns("edges", metrology::kEdgesColumns);
  for (const Touch& touch : recording.touches()) {
    const Seconds seconds{recording.machineRows(touch).front().at,
                          masterSecondsPerNs(touch.map, scales.nominal_period)};
    appendMachine(machine, recording, touch, scales, seconds);
    appendRequest(touches, touch.request);
    if (!touch.contact || !touch.release) continue;  // none of these is kept
    edges.append({static_cast<double>(touch.request.step), seconds(*touch.contact), seconds(*touch.release)});
  }
  return {
      .method = std::move(method), .config = {}, .tables = {std::move(machine), std::move(touches), std::move(edges)}};
}

}  // namespace probebox::capture
