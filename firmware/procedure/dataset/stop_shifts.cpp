#include "firmware/procedure/dataset/stop_shifts.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/switched_readings.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;

// Use of B in a run.
struct MotionOfB {
  bool of_table{};
  bool of_head{};
};

MotionOfB motionOfB(const capture::Recording& recording) {
  const auto touches = recording.touches();
  const auto swivels = [](const capture::Touch& touch) { return touch.request.swivels; };
  if (std::ranges::any_of(touches, swivels)) return {.of_table = false, .of_head = true};
  const auto tilt = [](const capture::Touch& touch) { return touch.request.rotary_angles_rad[1]; };
  const auto [least, greatest] = std::ranges::minmax(touches, {}, tilt);
  return {.of_table = tilt(greatest) - tilt(least) > kSameStop_rad, .of_head = false};
}

// Pivots and swivel errors have the stops of the head in the sd of their readings.
bool hasOwnStopsOfHead(const FinishedRun& run, const MotionOfB& b) {
  return b.of_head && run.method.feature != Feature::part_ball;
}

bool isSensorHead(const Facts& facts, std::uint32_t tool) {
  return facts.sensor_head && tool == facts.sensor_head->tool;
}

// Length of the probe in the spindle; 0 where it is not described. A sensor head's centre is described from the first.
double lengthOfProbe(const Facts& facts, std::uint32_t tool) {
  const bool is_first = tool == 0 || isSensorHead(facts, tool);
  return facts.lengthOf(is_first ? facts.probe_tools.numbers[0] : tool);
}

// Where what measures hangs below the gauge line with the head level: a stylus ball, or the centre of a sensor head.
Vector3d levelTip(const Facts& facts, std::uint32_t tool) {
  const Vector3d tip{0, 0, -lengthOfProbe(facts, tool)};
  return isSensorHead(facts, tool) ? Vector3d{tip + vectorOf(facts.sensor_head->centre_offset_mm)} : tip;
}

// From the tip of the first probe with the head level, of which machine positions are, to that of this one. Readings of
// a sensor head are places already.
Vector3d tipFromFirst(const Facts& facts, std::uint32_t tool, double length_mm, double b_rad) {
  if (isSensorHead(facts, tool)) return Vector3d::Zero();
  const double first_mm = facts.lengthOf(facts.probe_tools.numbers[0]);
  const HeadFacts head = facts.swivel_head.value_or(HeadFacts{});
  return nominalTip(head, b_rad, length_mm) - nominalTip(head, 0, first_mm);
}

// Displacement of a ball of the part by one sd of the table's stop.
Vector3d movedByTable(const Facts& facts, const Vector3d& ball_mm) {
  const BFacts& table = *facts.tilting_table;
  return table.sigma_rad * vectorOf(table.axis).cross(ball_mm - vectorOf(*table.point_mm));
}

// Displacement of a tip by one sd of the head's stop at B. tip_mm: below the gauge line of the level head.
Vector3d movedByHead(const Facts& facts, const Vector3d& tip_mm, double b_rad = 0) {
  const HeadFacts& head = *facts.swivel_head;
  const Vector3d axis = vectorOf(head.b.axis);
  return head.b.sigma_rad * axis.cross(Eigen::AngleAxisd{b_rad, axis} * (tip_mm - vectorOf(head.pivot_mm)));
}

// Axes that stood still in a run and move what it reads. Where one is not described well enough to say how far, a
// warning says so.
struct Standing {
  bool table{}, head{};
  std::vector<std::string> warnings;
};

Standing standingIn(const FinishedRun& run, bool lengths_are_known) {
  Standing standing;
  const MotionOfB b = motionOfB(run.recording);
  const auto& table = run.facts.tilting_table;
  if (table && table->sigma_rad > 0 && !b.of_table && run.method.feature == Feature::part_ball) {
    standing.table = table->point_mm.has_value();
    if (!standing.table)
      standing.warnings.emplace_back(
          "the sd does not include the positioning error of the tilting table, because the position of its axis is not "
          "described: give "
          "[tilting_table] point_mm in machine.toml");
  }
  const auto& head = run.facts.swivel_head;
  if (head && head->b.sigma_rad > 0 && !hasOwnStopsOfHead(run, b)) {
    standing.head = lengths_are_known;
    if (!standing.head)
      standing.warnings.emplace_back(
          "the sd does not include the positioning error of the swivelling head, because the length of the probe is "
          "not described: give "
          "[probe_tools] numbers in machine.toml, and the [[tool]] of each");
  }
  return standing;
}

}  // namespace

BallReadings withTableFurther(BallReadings found, const Facts& facts) {
  for (auto& reading : found.readings) {
    auto& at_mm = reading.centre.centre_mm;
    const double length_mm = lengthOfProbe(facts, reading.tool);
    at_mm += movedByTable(facts, at_mm + tipFromFirst(facts, reading.tool, length_mm, reading.b_rad));
  }
  if (!facts.probe_shank) return found;
  const ProbeShank& shank = *facts.probe_shank;
  for (auto& touch : found.shank)
    touch.at_mm += movedByTable(facts, touch.at_mm + tipFromFirst(facts, shank.tool, shank.tip_length_mm, touch.b_rad));
  return found;
}

BallReadings withHeadFurther(BallReadings found, const Facts& facts) {
  for (auto& reading : found.readings) {
    if (std::abs(reading.b_rad) > kPoseTolerance_rad) continue;
    reading.centre.centre_mm -= movedByHead(facts, levelTip(facts, reading.tool));
  }
  if (!facts.probe_shank) return found;
  for (auto& touch : found.shank) touch.at_mm -= movedByHead(facts, {0, 0, -facts.probe_shank->length_mm()});
  return found;
}

std::vector<StylusMove> movedByStops(const FinishedRun& run, const Vector3d& ball_mm, std::uint32_t tool) {
  const Standing standing = standingIn(run, lengthOfProbe(run.facts, tool) > 0);
  std::vector<StylusMove> moves;
  if (standing.table) moves.push_back({metrology::kTableStands, -movedByTable(run.facts, ball_mm)});
  if (standing.head) moves.push_back({metrology::kHeadStands, movedByHead(run.facts, levelTip(run.facts, tool))});
  return moves;
}

std::vector<std::string> unplacedStops(const FinishedRun& run, std::uint32_t tool) {
  return standingIn(run, lengthOfProbe(run.facts, tool) > 0).warnings;
}

std::vector<std::string> addStopOfHead(metrology::Dataset& dataset, const FinishedRun& run) {
  const std::uint32_t tool = run.recording.touches().empty() ? 0 : run.recording.touches().front().request.tool;
  Standing standing = standingIn(run, lengthOfProbe(run.facts, tool) > 0);
  if (!standing.head) return std::move(standing.warnings);
  const Vector3d machine_mm = -movedByHead(run.facts, levelTip(run.facts, tool));
  auto shift = metrology::Table::withColumns("machine" + std::string{metrology::kHeadStands.suffix},
                                             metrology::column::kPosition);
  shift.append({machine_mm.x(), machine_mm.y(), machine_mm.z()});
  dataset.tables.push_back(std::move(shift));
  return std::move(standing.warnings);
}

void addStopsOfHead(metrology::Dataset& dataset, std::string_view table, std::span<const std::string_view, 3> columns,
                    std::span<const TouchingTip> rows, const Facts& facts) {
  if (!facts.swivel_head || facts.swivel_head->b.sigma_rad <= 0 || rows.empty()) return;
  const auto turned = [&](const TouchingTip& row) { return std::abs(row.b_rad - rows.front().b_rad) > kSameStop_rad; };
  const bool swivels = std::ranges::any_of(rows, turned);
  std::vector<std::string_view> names{columns.begin(), columns.end()};
  if (swivels) names.push_back(metrology::kOfStop);
  auto shift = metrology::Table::withColumns(std::string{table} + std::string{metrology::kHeadStands.suffix}, names);
  double stop = 1;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const TouchingTip& row = rows[k];
    const bool other_stop =
        k > 0 && (std::abs(row.b_rad - rows[k - 1].b_rad) > kSameStop_rad || row.tip_mm != rows[k - 1].tip_mm);
    stop += other_stop ? 1 : 0;
    const Vector3d machine_mm = -movedByHead(facts, row.tip_mm, row.b_rad);
    if (swivels)
      shift.append({machine_mm.x(), machine_mm.y(), machine_mm.z(), stop});
    else
      shift.append({machine_mm.x(), machine_mm.y(), machine_mm.z()});
  }
  dataset.tables.push_back(std::move(shift));
}

std::vector<std::string> addStopShifts(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run,
                                       void (*tables)(metrology::Dataset&, const BallReadings&, const FinishedRun&)) {
  const auto add = [&](const BallReadings& further, const metrology::StandingAxis& axis) {
    metrology::Dataset shifted{.method = dataset.method, .config = dataset.config, .tables = {}};
    tables(shifted, further, run);
    addShifts(dataset, shifted, axis.suffix);
  };
  const bool known =
      std::ranges::all_of(found.readings, [&](const Reading& r) { return lengthOfProbe(run.facts, r.tool) > 0; });
  Standing standing = standingIn(run, known);
  if (standing.table) add(withTableFurther(found, run.facts), metrology::kTableStands);
  if (standing.head) add(withHeadFurther(found, run.facts), metrology::kHeadStands);
  return std::move(standing.warnings);
}

}  // namespace probebox::procedure
