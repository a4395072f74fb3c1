#include "firmware/metrology/scan/scan_points.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kStrideOfSpeed_s = 0.020;  // in which noise is small against the way
constexpr double kSpeedOfCircle = 0.2;      // share that the speed may differ from the nominal one
constexpr double kMostSpan = 10.0;          // of a scan, in what its samples cover: grids are as long as the span
constexpr double kSpeedOfPath = 0.4;        // of a path that may turn and bend

std::vector<std::size_t> rowsOf(const std::vector<double>& ids, double id) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (ids[row] == id) rows.push_back(row);
  }
  return rows;
}

std::optional<Refusal> wrongStamps(const std::vector<double>& times, const std::string& scan,
                                   const std::string& table) {
  if (times.size() < kLeastOfContour) {
    return Refusal{"too-few-samples", scan + " has " + std::to_string(times.size()) + " samples in table '" + table +
                                          "', fifty are needed; record it again"};
  }
  if (std::ranges::is_sorted(times, std::ranges::less_equal{})) return std::nullopt;
  return Refusal{"time-not-rising", scan + " in table '" + table +
                                        "': the time stamps do not increase; give every sample once, in order of time"};
}

// A scan whose time is almost all without samples, as with one stamp of another clock.
std::optional<Refusal> mostlyEmpty(const std::vector<double>& times, const std::string& scan,
                                   const std::string& table) {
  const double period = Signal{times, {}}.period();
  if (times.back() - times.front() <= kMostSpan * static_cast<double>(times.size()) * period) return std::nullopt;
  std::size_t widest = 1;
  for (std::size_t k = 2; k < times.size(); ++k)
    if (times[k] - times[k - 1] > times[widest] - times[widest - 1]) widest = k;
  return Refusal{"gap", scan + " in table '" + table + "' has samples for little of its time, none from " +
                            text(times[widest - 1]) + " s to " + text(times[widest]) +
                            " s: check the stamps, and record it again"};
}

// Speed along the path, mm/s, over times in which the way is straight.
double speedOf(const ScanPoints& points) {
  const auto count = points.times.size();
  const double period = (points.times.back() - points.times.front()) / static_cast<double>(count - 1);
  const auto most = static_cast<double>(count) / 4.0;
  const auto stride = static_cast<std::size_t>(std::clamp(kStrideOfSpeed_s / period, 1.0, most));
  std::vector<double> speeds;
  for (std::size_t k = stride; k < count; ++k) {
    speeds.push_back((points.values[k] - points.values[k - stride]).norm() /
                     (points.times[k] - points.times[k - stride]));
  }
  return median(speeds);
}

}  // namespace

Outcome<ScanPoints, Refusal> scanPoints(const Table& table, const ColumnNames& columns, double id,
                                        const std::string& scan) {
  const Stream stream = streamOf(table, columns, rowsOf(*table.column(columns[0]), id));
  if (auto refusal = wrongStamps(stream.times, scan, table.name)) return *refusal;
  if (auto refusal = mostlyEmpty(stream.times, scan, table.name)) return *refusal;
  Despiked clean = withoutSpikes(stream, 0.0);
  ScanPoints points;
  for (const double time : clean.removed)
    points.spikes.push_back(scan + ", " + table.name + " at " + text(time) + " s");
  points.values.reserve(clean.stream.times.size());
  for (const auto row : clean.stream.values.rowwise()) points.values.emplace_back(row.transpose());
  points.times = std::move(clean.stream.times);
  return points;
}

std::optional<Refusal> speedDiffers(const ScanPoints& machine, const std::string& scan, double nominal_mm_s,
                                    bool in_circles) {
  const double speed = speedOf(machine);
  if (std::abs(speed - nominal_mm_s) <= (in_circles ? kSpeedOfCircle : kSpeedOfPath) * nominal_mm_s)
    return std::nullopt;
  return Refusal{"speed-differs", scan + ": the machine scans at " + text(speed) + " mm/s where " + text(nominal_mm_s) +
                                      " is stated; set the feed override to 100 %, or correct the time stamps"};
}

}  // namespace probebox::metrology
