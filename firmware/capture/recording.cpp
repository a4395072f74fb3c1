#include "firmware/capture/recording.hpp"

#include <algorithm>

namespace probebox::capture {
namespace {

template <class Row>
bool appendWithinCapacity(std::vector<Row>& rows, const Row& row) {
  if (rows.size() == rows.capacity()) return false;
  rows.push_back(row);
  return true;
}

// Keeps of the rows from `begin` on those within [from, until], and returns their end.
template <class Row>
std::size_t keptWithin(MonoTime from, MonoTime until, std::size_t begin, std::vector<Row>& rows) {
  const auto outside = [&](const Row& row) { return row.at < from || row.at > until; };
  const auto first = rows.begin() + static_cast<std::ptrdiff_t>(begin);
  rows.erase(std::remove_if(first, rows.end(), outside), rows.end());
  return rows.size();
}

}  // namespace

Recording::Recording(Capacity capacity) {
  machine_rows_.reserve(capacity.machine_rows);
  probe_rows_.reserve(capacity.probe_rows);
  drift_rows_.reserve(capacity.drift_rows);
  angle_rows_.reserve(capacity.angle_rows);
  touches_.reserve(capacity.touches);
  contacts_.reserve(capacity.contacts);
}

void Recording::clear() {
  machine_rows_.clear();
  probe_rows_.clear();
  drift_rows_.clear();
  angle_rows_.clear();
  touches_.clear();
  contacts_.clear();
}

bool Recording::append(const MachineRow& row) {
  return appendWithinCapacity(machine_rows_, row);
}
bool Recording::append(const ProbeRow& row) {
  return appendWithinCapacity(probe_rows_, row);
}
bool Recording::append(const DriftRow& row) {
  return appendWithinCapacity(drift_rows_, row);
}
bool Recording::append(const AngleRow& row) {
  return appendWithinCapacity(angle_rows_, row);
}
bool Recording::append(const Touch& touch) {
  return appendWithinCapacity(touch.request.until_contact ? contacts_ : touches_, touch);
}

void Recording::truncate(const Touch& touch) {
  machine_rows_.resize(touch.machine_begin);
  probe_rows_.resize(touch.probe_begin);
  drift_rows_.resize(touch.drift_begin);
  angle_rows_.resize(touch.angle_begin);
}

void Recording::keepWithin(MonoTime from, MonoTime until, Touch& newest) {
  newest.machine_end = keptWithin(from, until, newest.machine_begin, machine_rows_);
  newest.probe_end = keptWithin(from, until, newest.probe_begin, probe_rows_);
}

std::span<const MachineRow> Recording::machineRows(const Touch& touch) const {
  return std::span{machine_rows_}.subspan(touch.machine_begin, touch.machine_end - touch.machine_begin);
}

std::span<const ProbeRow> Recording::probeRows(const Touch& touch) const {
  return std::span{probe_rows_}.subspan(touch.probe_begin, touch.probe_end - touch.probe_begin);
}

std::span<const DriftRow> Recording::driftRows(const Touch& touch) const {
  return std::span{drift_rows_}.subspan(touch.drift_begin, touch.drift_end - touch.drift_begin);
}

std::span<const AngleRow> Recording::angleRows(const Touch& touch) const {
  return std::span{angle_rows_}.subspan(touch.angle_begin, touch.angle_end - touch.angle_begin);
}

}  // namespace probebox::capture
