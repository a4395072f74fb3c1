#include "firmware/procedure/methods/sweep.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "firmware/capture/touch_capture.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

constexpr unsigned kUsualTurns = 4;
constexpr unsigned kFewestTurns = 3;  // (D4)
constexpr unsigned kMostTurns = 20;
// At 3 rpm a sensor of 0.15 s takes 0.4 % off the second harmonic of the face.
constexpr double kUsual_rpm = 3;
// The table is used whole up to here (D5).
constexpr double kWholeTable = 0.9;

// As long as positions find room, less a minute for whoever marks begin and end.
constexpr double kLongest_s = static_cast<double>(capture::Capacity{}.machine_rows) *
                                  std::chrono::duration<double>{capture::kSweepInterval}.count() -
                              60;

// An axis that was driven to a place stands a little beside it.
constexpr double kAtRest_mm = 0.01;

std::string nameOfAxis(std::size_t axis) {
  return std::string{"XYZ"[axis]};
}

// Never below: it is to be given as it is read.
std::string roundedUp(double value) {
  return number(std::ceil(value * 1e3) / 1e3);
}

std::optional<Error> whyTooLong(const ProcedureOptions& sweep) {
  const double duration_s = sweep.travel_mm / sweep.speeds_mm_s[0];
  if (duration_s <= kLongest_s) return std::nullopt;
  return Error{"A travel of " + number(sweep.travel_mm) + " mm at " + number(sweep.speeds_mm_s[0]) + " mm/s takes " +
               number(duration_s) + " s, but a recording holds at most " + number(kLongest_s) + " s: give at least " +
               roundedUp(sweep.travel_mm / kLongest_s) + " mm/s, or fewer turns."};
}

// Positions of one motor over time.
class Way {
 public:
  Way(std::span<const capture::MachineRow> rows, std::size_t axis, double mm_per_count, double offset_mm)
      : rows_{rows}, axis_{axis}, mm_per_count_{mm_per_count}, offset_mm_{offset_mm} {}

  // Linear between the rows on either side; nothing outside of them. Times may only rise.
  std::optional<double> motor_mm(MonoTime at) {
    if (at < rows_.front().at || at > rows_.back().at) return std::nullopt;
    while (next_ + 1 < rows_.size() && rows_[next_].at < at) ++next_;
    const auto& after = rows_[next_];
    if (next_ == 0 || after.at <= at) return position(after);
    const auto& before = rows_[next_ - 1];
    const double share =
        static_cast<double>((at - before.at).count()) / static_cast<double>((after.at - before.at).count());
    return position(before) + share * (position(after) - position(before));
  }

 private:
  double position(const capture::MachineRow& row) const {
    return static_cast<double>(row.counts[axis_]) * mm_per_count_ + offset_mm_;
  }

  std::span<const capture::MachineRow> rows_;
  std::size_t axis_;
  double mm_per_count_;
  double offset_mm_;
  std::size_t next_{};
};

}  // namespace

// The angle of the screw comes from the position of its axis.
std::optional<Error> whyScrewUnread(std::uint8_t axis, const MachineNow& now) {
  const AxisNow& at = now.at(axis - 1U);
  const std::string name = nameOfAxis(axis - 1U);
  if (!at.referenced) {
    return Error{"The angle of a screw follows from a machine position, and the axis " + name +
                 " is not referenced: home it, or move it over its reference mark."};
  }
  if (at.screw_sensor_valid) return std::nullopt;
  return Error{"The sensor of the screw of " + name + " delivers no valid readings: `probebox corrections` shows why."};
}

Outcome<ProcedureOptions> sweepOptions(ProcedureOptions options, const Facts& facts) {
  const std::string method{kScrewCalibration.name()};
  if (options.axis < 1 || options.axis > kLinearAxes)
    return Error{method + " measures one screw: name its axis, X, Y or Z (--axis X)."};
  const std::string axis = nameOfAxis(options.axis - 1U);
  const auto& screw = facts.screws[options.axis - 1U];
  if (!screw) {
    return Error{"The screw of " + axis + " is not described: give [screw." + axis +
                 "] in machine.toml, or choose an axis that has a sensor on its screw."};
  }
  const unsigned turns = options.turns == 0 ? kUsualTurns : options.turns;
  if (turns < kFewestTurns || turns > kMostTurns) {
    return Error{number(turns) + " turns are not possible: give " + number(kFewestTurns) + " to " + number(kMostTurns) +
                 "; separating the drift from the face run-out needs 3 whole turns."};
  }
  const double most_rpm = kWholeTable * screw->threshold_rpm;
  if (options.speed_count == 0) {
    options.speed_count = 1;
    options.speeds_mm_s[0] = std::min(kUsual_rpm, most_rpm) * screw->pitch_mm / 60;
  }
  const double rpm = 60 * options.speeds_mm_s[0] / screw->pitch_mm;
  if (rpm > most_rpm) {
    return Error{number(options.speeds_mm_s[0]) + " mm/s turns the screw of " + axis + " at " + number(rpm) +
                 " rpm, but its sensor can follow the face only up to " + number(most_rpm) +
                 " (threshold_rpm of machine.toml): " + "give at most " + number(most_rpm * screw->pitch_mm / 60) +
                 " mm/s."};
  }
  options.travel_mm = turns * screw->pitch_mm;
  options.turns = 0;
  if (const auto error = whyTooLong(options)) return *error;
  return options;
}

std::optional<Error> whyNoRoom(const ProcedureOptions& sweep, double position_mm, const Facts& facts) {
  const auto& screw = facts.screws.at(sweep.axis - 1U);
  if (!screw) return std::nullopt;
  const std::string axis = nameOfAxis(sweep.axis - 1U);
  const double last_mm = screw->travel_max_mm - sweep.travel_mm;
  const std::string way = "The travel of +" + number(sweep.travel_mm) + " mm";
  if (last_mm < screw->travel_min_mm) {
    return Error{way + " is longer than the range of " + axis + ", which is from " + number(screw->travel_min_mm) +
                 " to " + number(screw->travel_max_mm) + " mm: choose fewer turns."};
  }
  if (position_mm <= last_mm + kAtRest_mm) return std::nullopt;
  return Error{way + " from " + number(position_mm) + " mm would end beyond the limit of " + axis + " at " +
               number(screw->travel_max_mm) + " mm: move " + axis + " to between " + number(screw->travel_min_mm) +
               " and " + number(last_mm) + " mm first."};
}

std::size_t appendScrewReadings(const FinishedRun& of, const capture::Touch& step, metrology::Table& table) {
  const auto rows = of.recording.driftRows(step);
  const std::size_t axis = axisAlong(step.request.outward_normal), before = table.rows();
  const auto& screw = of.facts.screws[axis].value();
  Way way{of.recording.machineRows(step), axis, of.scales.mm_per_count[axis], of.recording.offset_mm()[axis]};
  const double rate = capture::masterSecondsPerNs(step.map, of.scales.nominal_period);
  for (const auto& row : rows) {
    const auto motor_mm = way.motor_mm(row.at);
    if (!motor_mm) continue;
    table.append({static_cast<double>((row.at - rows.front().at).count()) * rate,
                  kTurn_rad * (*motor_mm - screw.sector_zero_mm) / screw.pitch_mm, row.reading_nm * 1e-3});
  }
  return rows.size() - (table.rows() - before);
}

std::optional<std::string> unplacedReadings(std::size_t unplaced, std::size_t readings) {
  if (unplaced == 0) return std::nullopt;
  return std::to_string(unplaced) + " of " + std::to_string(readings) +
         " readings of the screw's sensor have no axis position before or after them and are omitted";
}

RunDataset sweepDataset(const FinishedRun& of) {
  const auto& [method, recording, scales, facts] = of;
  RunDataset run{{.method = std::string{method.name()}, .config = {}, .tables = {}}, {}, {}};
  auto& config = run.dataset.config;
  auto face = metrology::emptyTable(metrology::kScrewCalibration, "sector_cal");
  std::size_t readings = 0, unplaced = 0;
  for (const auto& sweep : recording.touches()) {
    const std::size_t axis = axisAlong(sweep.request.outward_normal);
    const auto& screw = facts.screws[axis];
    if (!screw) continue;
    config["axis"] = nameOfAxis(axis);
    config["screw_length_mm"] = screw->length_mm;
    config["orgoff_mm"] = screw->offset_mm;
    if (screw->reversed) config["axis_reversed"] = true;
    config["sectors"] = static_cast<double>(kMostScrewSectors);
    config["K"] = screw->gain;
    readings += recording.driftRows(sweep).size();
    unplaced += appendScrewReadings(of, sweep, face);
  }
  if (auto warning = unplacedReadings(unplaced, readings)) run.warnings.push_back(*std::move(warning));
  run.dataset.tables.push_back(std::move(face));
  return run;
}

}  // namespace probebox::procedure
