#include "firmware/procedure/dataset/ball_readings.hpp"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/metrology/dataset/pre_travel_shifts.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/touch/ball_centre.hpp"
#include "firmware/metrology/touch/switched_centre.hpp"
#include "firmware/procedure/dataset/known_delay.hpp"
#include "firmware/procedure/dataset/shank_readings.hpp"
#include "firmware/procedure/dataset/stop_shifts.hpp"
#include "firmware/procedure/dataset/switched_readings.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 12> kCentresColumns{
    "reading", "ball", "A_rad", "B_rad", "C_rad", "x_mm", "y_mm", "z_mm", "sd_x_mm", "sd_y_mm", "sd_z_mm", "radius_mm"};
constexpr std::array<std::string_view, 6> kPosesColumns{"touch", "reading", "ball", "A_rad", "B_rad", "C_rad"};

metrology::Table posesOf(const capture::Recording& recording) {
  auto poses = metrology::Table::withColumns("poses", kPosesColumns);
  for (const auto& touch : recording.touches()) {
    const auto& at = touch.request;
    poses.append({static_cast<double>(at.step), static_cast<double>(at.reading), static_cast<double>(at.ball),
                  at.rotary_angles_rad[0], at.rotary_angles_rad[1], at.rotary_angles_rad[2]});
  }
  return poses;
}

metrology::Table centresOf(const std::vector<Reading>& readings) {
  auto centres = metrology::Table::withColumns("centres", kCentresColumns);
  for (const auto& reading : readings) {
    const auto& [centre, sd, radius] = reading.centre;
    centres.append({reading.number, reading.ball, reading.a_rad, reading.b_rad, reading.c_rad, centre.x(), centre.y(),
                    centre.z(), sd.x(), sd.y(), sd.z(), radius});
  }
  return centres;
}

// The poses of the readings; their centres are still to be computed.
struct Posed {
  std::vector<Reading> readings;
  std::vector<std::size_t> reading_of_touch;
};

// The stop of C of every touch: C stands where it is until it is sent elsewhere.
std::vector<double> stopsOf(const capture::Recording& recording) {
  std::vector<double> stops;
  double at_rad = 0;
  for (const auto& touch : recording.touches()) {
    const double c_rad = touch.request.rotary_angles_rad[2];
    const bool turned = !stops.empty() && std::abs(c_rad - at_rad) > kSameStop_rad;
    stops.push_back(stops.empty() ? 0 : stops.back() + (turned ? 1 : 0));
    at_rad = c_rad;
  }
  return stops;
}

Posed posedOf(const capture::Recording& recording) {
  Posed posed;
  auto& [readings, reading_of_touch] = posed;
  const auto stops = stopsOf(recording);
  double touches = 0;  // of the last reading
  for (std::size_t touch = 0; touch < stops.size(); ++touch) {
    const auto& at = recording.touches()[touch].request;
    const bool by_shank = at.shank_height_mm > 0;
    const bool is_new = readings.empty() || readings.back().number != at.reading;
    reading_of_touch.push_back(by_shank ? metrology::kAlone : readings.size() - (is_new ? 0 : 1));
    if (by_shank) continue;
    const double time_s = timeOf(recording, recording.touches()[touch]);
    if (!is_new) {
      readings.back().time_s += (time_s - readings.back().time_s) / ++touches;
      continue;
    }
    touches = 1;
    readings.push_back({.number = static_cast<double>(at.reading),
                        .ball = static_cast<double>(at.ball),
                        .a_rad = at.rotary_angles_rad[0],
                        .b_rad = at.rotary_angles_rad[1],
                        .c_rad = at.rotary_angles_rad[2],
                        .stop = stops[touch],
                        .tool = at.tool,
                        .mount = at.mount,
                        .note = at.note,
                        .time_s = time_s,
                        .centre = {}});
  }
  return posed;
}

BallReadings placed(std::vector<Reading> readings, const metrology::BallCentres& centres,
                    const capture::Recording& recording) {
  BallReadings found;
  const auto stops = stopsOf(recording);
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].centre = centres.readings[i];
  for (const auto& lone : centres.alone) {
    const auto& at = recording.touches()[lone.touch].request;
    const auto& [a_rad, b_rad, c_rad] = at.rotary_angles_rad;
    found.shank.push_back({.number = static_cast<double>(at.reading),
                           .side = vectorOf(at.outward_normal),
                           .a_rad = a_rad,
                           .b_rad = b_rad,
                           .c_rad = c_rad,
                           .stop = stops[lone.touch],
                           .at_mm = lone.at_mm,
                           .sd_mm = lone.sd_mm});
  }
  found.readings = std::move(readings);
  found.dropped = centres.dropped;
  return found;
}

Outcome<BallReadings, metrology::Refusal> readingsOf(const metrology::Dataset& touches, const FinishedRun& run) {
  const auto& recording = run.recording;
  auto posed = posedOf(recording);
  const auto plane = run.facts.has_y ? metrology::Plane::none : metrology::Plane::xz;
  TRY(const auto centres, metrology::ballCentres(touches, posed.reading_of_touch, recording.delay().tau_s, plane));
  return placed(std::move(posed.readings), centres, recording);
}

using AddTables = void (*)(metrology::Dataset&, const BallReadings&, const FinishedRun&);

Outcome<BallReadings, metrology::Refusal> switchedReadings(const std::vector<metrology::SwitchedTouch>& touches,
                                                           const FinishedRun& run) {
  auto posed = posedOf(run.recording);
  TRY(const auto centres,
      metrology::switchedCentres(touches, posed.reading_of_touch, run.facts.trigger_probe->repeatability_mm));
  return placed(std::move(posed.readings), centres, run.recording);
}

// Takes the middle of the ball out of touches with the shank, and adds the method's tables.
std::optional<metrology::Refusal> addTables(metrology::Dataset& dataset, BallReadings& found, const FinishedRun& run,
                                            AddTables tables) {
  if (auto refusal = centreTouches(found.shank, found.readings, run.facts)) return refusal;
  tables(dataset, found, run);
  return std::nullopt;
}

// And what one sd of the stops of table and head changes them by.
std::optional<metrology::Refusal> addFound(RunDataset& built, BallReadings& found, const FinishedRun& run,
                                           AddTables tables) {
  auto& dataset = built.dataset;
  if (auto refusal = addTables(dataset, found, run, tables)) return refusal;
  built.warnings = addStopShifts(dataset, found, run, tables);
  if (auto warning = droppedTouches(found.dropped)) built.warnings.push_back(*std::move(warning));
  if (dataset.table("centres") == nullptr) dataset.tables.push_back(centresOf(found.readings));
  return std::nullopt;
}

// Adds the shifts of the method's tables by one sd of each cause of uncertainty of the pre-travels. Each tool's
// pre-travel was measured by itself, so no cause is common to two of them.
std::optional<metrology::Refusal> addPreTravelShifts(metrology::Dataset& dataset, const FinishedRun& run,
                                                     const std::vector<metrology::SwitchedTouch>& touches,
                                                     const std::vector<PreTravel>& pre_travels, AddTables tables) {
  std::size_t number = 0;
  for (const auto& pre_travel : pre_travels) {
    const Eigen::Matrix4d causes = causesOf(pre_travel);
    for (Eigen::Index cause = 0; cause < causes.cols(); ++cause) {
      TRY(auto found, switchedReadings(withoutPreTravel(touches, run, pre_travel.tool, causes.col(cause)), run));
      metrology::Dataset shifted{.method = dataset.method, .config = dataset.config, .tables = {}};
      if (auto refusal = addTables(shifted, found, run, tables)) return refusal;
      addShifts(dataset, shifted, std::string{metrology::kByPreTravel} + std::to_string(++number));
    }
  }
  return std::nullopt;
}

// Readings of a touch-trigger probe. Its ways in and out cancel the delay, so none has to be in force.
std::optional<metrology::Refusal> addSwitchedReadings(RunDataset& built, const FinishedRun& run, AddTables tables) {
  auto& dataset = built.dataset;
  dataset.tables.push_back(posesOf(run.recording));
  TRY(auto touches, metrology::switchedTouches(dataset, {}));
  if (run.method.cancels_pre_travel) {  // each tool has one of its own
    TRY(auto found, switchedReadings(touches, run));
    return addFound(built, found, run, tables);
  }
  TRY(const auto pre_travels, preTravelsOf(run));
  for (const auto& pre_travel : pre_travels)
    touches = withoutPreTravel(std::move(touches), run, pre_travel.tool, Eigen::Vector4d{pre_travel.parts_mm.data()});
  addPreTravelResults(dataset, pre_travels);
  TRY(auto found, switchedReadings(touches, run));
  if (auto refusal = addFound(built, found, run, tables)) return refusal;
  return addPreTravelShifts(dataset, run, touches, pre_travels, tables);
}

std::optional<metrology::Refusal> addReadings(RunDataset& built, const FinishedRun& run, AddTables tables) {
  auto& dataset = built.dataset;
  dataset.tables.push_back(posesOf(run.recording));
  const auto& delay = run.recording.delay();
  if (lacksAnAxis(delay)) {
    return metrology::Refusal{
        "no-delay",
        "no system delay of every axis is in force, so the touches are displaced from the surface by an "
        "unknown lag: calibrate the delay first, accept it, and measure again"};
  }
  dataset.config["delay_result"] = static_cast<double>(delay.result_id);
  dataset.config["previous_tau_axis_s"] = std::vector<double>{delay.tau_s.begin(), delay.tau_s.end()};
  TRY(auto found, readingsOf(dataset, run));
  return addFound(built, found, run, tables);
}

}  // namespace

std::optional<std::string> droppedTouches(const std::vector<metrology::Dropped>& dropped) {
  std::string names;
  for (const auto& [name, reason] : dropped) names += (names.empty() ? "" : ", ") + name + " (" + reason + ")";
  if (names.empty()) return std::nullopt;
  return "dropped: " + names +
         ": what is read there rests on the other touches; look what is in the way, and touch again";
}

metrology::Dataset touchesOf(const FinishedRun& run) {
  if (readsBySwitch(run)) return capture::edgeDataset(run.recording, run.scales, std::string{run.method.name()});
  return capture::touchDataset(run.recording, run.scales, std::string{run.method.name()});
}

metrology::Dataset touchesAndPoseOf(const FinishedRun& run) {
  auto dataset = touchesOf(run);
  addProbePose(dataset, run.recording);
  return dataset;
}

RunDataset sphereRun(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  built.warnings = addStopOfHead(built.dataset, run);
  return built;
}

// Whole turns aside, so that they do not change a mean.
void addProbePose(metrology::Dataset& dataset, const capture::Recording& recording) {
  double a_rad = 0, b_rad = 0, count = 0;
  for (const auto& touch : recording.touches()) {
    if (touch.request.travel_mm != 0) continue;  // a jog is at any angle
    a_rad += std::remainder(touch.request.rotary_angles_rad[0], kTurn_rad);
    b_rad += std::remainder(touch.request.rotary_angles_rad[1], kTurn_rad);
    ++count;
  }
  if (count == 0) return;
  dataset.config[std::string{metrology::kProbeA.name}] = a_rad / count;
  dataset.config[std::string{metrology::kProbeB.name}] = b_rad / count;
}

RunDataset ballDataset(const FinishedRun& run,
                       void (*tables)(metrology::Dataset&, const BallReadings&, const FinishedRun&)) {
  RunDataset built{touchesOf(run), {}, {}};
  const auto touches = run.recording.touches();
  if (!touches.empty() && touches.front().request.spindle == kSecondSpindle)
    built.dataset.config[std::string{metrology::key::kSpindle.name}] = double{kSecondSpindle};
  built.refusal = readsBySwitch(run) ? addSwitchedReadings(built, run, tables) : addReadings(built, run, tables);
  return built;
}

void addSigmas(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts) {
  dataset.config["sigma_mm"] = sigmaOf(readings);
  dataset.config["sigma_C_rad"] = facts.sigma_c_rad;
}

void addMeanHeight(metrology::Dataset& dataset, const std::vector<Reading>& readings) {
  double sum_mm = 0;
  for (const auto& reading : readings) sum_mm += reading.centre.centre_mm.z();
  if (!readings.empty()) dataset.config["mean_z_mm"] = sum_mm / static_cast<double>(readings.size());
}

void addCentreline(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts,
                   const metrology::Method& method, double sense) {
  addSigmas(dataset, readings, facts);
  addMeanHeight(dataset, readings);
  auto table = metrology::emptyTable(method, "readings");
  for (const auto& reading : readings)
    table.append({sense * reading.c_rad, reading.centre.centre_mm.x(), reading.centre.centre_mm.y()});
  table.columns.push_back(timesOf(readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

void addSpindleOffset(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  const auto& readings = found.readings;
  addSigmas(dataset, readings, run.facts);
  auto table = metrology::emptyTable(metrology::kSpindleOffsetFour, "readings", {metrology::column::kStop});
  for (const auto& reading : readings)
    table.append(
        {reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(), reading.centre.centre_mm.y(), reading.stop});
  table.columns.push_back(timesOf(readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

}  // namespace probebox::procedure
