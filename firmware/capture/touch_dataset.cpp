#include "firmware/capture/touch_dataset.hpp"

#include <algorithm>
#include <utility>

namespace probebox::capture {
namespace {

constexpr double kMillimetresPerNanometre = 1e-6;

// Of the tool: the encoders sit on the motors, and a warm screw lies between.
double millimetres(const MachineRow& row, const Scales& scales, double offset_mm, std::size_t axis) {
  return static_cast<double>(row.counts[axis]) * scales.mm_per_count[axis] + offset_mm -
         row.screw_nm[axis] * kMillimetresPerNanometre;
}

}  // namespace

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
    const MonoTime origin = std::min(machine_rows.front().at, probe_rows.front().at);
    const double rate = masterSecondsPerNs(touch.map, scales.nominal_period);
    const auto seconds = [&](MonoTime at) { return static_cast<double>((at - origin).count()) * rate; };
    const double number = touch.request.step;
    for (const MachineRow& row : machine_rows) {
      const auto position = [&](std::size_t axis) {
        return millimetres(row, scales, recording.offset_mm()[axis], axis);
      };
      machine.append({number, seconds(row.at), position(0), position(1), position(2)});
    }
    for (const ProbeRow& row : probe_rows) {
      const auto channel = [&row](std::size_t i) { return row.channels_nm[i] * kMillimetresPerNanometre; };
      probe.append({number, seconds(row.at), channel(0), channel(1), channel(2)});
    }
    const auto& n = touch.request.outward_normal;
    const auto& u = touch.request.retract_direction;
    touches.append({number, n[0], n[1], n[2], u[0], u[1], u[2], touch.request.retract_speed_mm_s});
  }
  return dataset;
}

}  // namespace probebox::capture
