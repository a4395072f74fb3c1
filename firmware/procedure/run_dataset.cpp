#include "firmware/procedure/run_dataset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/ball_centre.hpp"
#include "firmware/metrology/selftest.hpp"
#include "firmware/procedure/sweep.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 3> kCentrelineColumns{"C_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 5> kAlignmentColumns{"z_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 11> kCentresColumns{
    "reading", "ball", "A_rad", "C_rad", "x_mm", "y_mm", "z_mm", "sd_x_mm", "sd_y_mm", "sd_z_mm", "radius_mm"};
constexpr std::array<std::string_view, 6> kPosesColumns{"touch", "reading", "ball", "A_rad", "B_rad", "C_rad"};

// One place of one ball, and what was found there.
struct Reading {
  double number{};
  double ball{};
  double a_rad{}, c_rad{};
  metrology::BallCentre centre;
};

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
    centres.append({reading.number, reading.ball, reading.a_rad, reading.c_rad, centre.x(), centre.y(), centre.z(),
                    sd.x(), sd.y(), sd.z(), radius});
  }
  return centres;
}

// Of one coordinate of one reading, X and Y together.
double sigmaOf(const std::vector<Reading>& readings) {
  double sum = 0;
  for (const auto& reading : readings) sum += reading.centre.sd_mm.head<2>().squaredNorm() / 2;
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// Mean distance of the places of one ball from their middle: on it an error of the angle acts.
double reachOf(const std::vector<Reading>& readings) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> places;
  for (const auto& reading : readings) {
    if (reading.ball == readings.front().ball) places.emplace_back(reading.centre.centre_mm.head<2>());
  }
  for (const auto& place : places) middle += place / static_cast<double>(places.size());
  double reach = 0;
  for (const auto& place : places) reach += (place - middle).norm() / static_cast<double>(places.size());
  return reach;
}

// Height of a ball: the mean of its places, so that one ball is one height.
double heightOf(const std::vector<Reading>& readings, double ball) {
  double sum = 0, count = 0;
  for (const auto& reading : readings) {
    if (reading.ball != ball) continue;
    sum += reading.centre.centre_mm.z();
    ++count;
  }
  return sum / count;
}

void addCentreline(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts) {
  dataset.config["sigma_mm"] = sigmaOf(readings);
  dataset.config["sigma_C_rad"] = facts.sigma_c_rad;
  auto table = metrology::Table::withColumns("readings", kCentrelineColumns);
  for (const auto& reading : readings)
    table.append({reading.c_rad, reading.centre.centre_mm.x(), reading.centre.centre_mm.y()});
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

void addAlignment(metrology::Dataset& dataset, std::vector<Reading> readings, const Facts& facts) {
  // The method has no key for an error of the angle. It acts in one direction of two, and the two readings of one stop
  // of C share it: for the mean of four readings that is an error of its full size in each.
  dataset.config["sigma_mm"] = std::hypot(sigmaOf(readings), reachOf(readings) * facts.sigma_c_rad);
  std::ranges::stable_sort(readings, {}, [](const Reading& r) { return std::array{r.ball, r.c_rad, r.a_rad}; });
  auto table = metrology::Table::withColumns("readings", kAlignmentColumns);
  for (const auto& reading : readings) {
    table.append({heightOf(readings, reading.ball), reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(),
                  reading.centre.centre_mm.y()});
  }
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

// The centres of all readings of a run, with the delay that was in force taken out.
Outcome<std::vector<Reading>, metrology::Refusal> readingsOf(const metrology::Dataset& touches,
                                                             const capture::Recording& recording) {
  std::vector<std::size_t> reading_of_touch;
  std::vector<Reading> readings;
  for (const auto& touch : recording.touches()) {
    const auto& at = touch.request;
    reading_of_touch.push_back(at.reading);
    if (at.reading < readings.size()) continue;
    readings.push_back({.number = static_cast<double>(at.reading),
                        .ball = static_cast<double>(at.ball),
                        .a_rad = at.rotary_angles_rad[0],
                        .c_rad = at.rotary_angles_rad[2],
                        .centre = {}});
  }
  const auto centres = metrology::ballCentres(touches, reading_of_touch, recording.delay().tau_s);
  if (!centres) return centres.error();
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].centre = centres->readings[i];
  return readings;
}

void addReadings(RunDataset& run, Method method, const capture::Recording& recording, const Facts& facts) {
  run.dataset.tables.push_back(posesOf(recording));
  const auto& delay = recording.delay();
  if (delay.result_id == 0) {
    run.refusal = metrology::Refusal{"no-delay",
                                     "no system delay is in force, so the touches lie beside the surface by an unknown "
                                     "lag: calibrate the delay first, accept it, and measure again"};
    return;
  }
  run.dataset.config["previous_tau_axis_s"] = std::vector<double>{delay.tau_s.begin(), delay.tau_s.end()};
  const auto readings = readingsOf(run.dataset, recording);
  if (!readings) {
    run.refusal = readings.error();
    return;
  }
  run.dataset.tables.push_back(centresOf(*readings));
  if (method == Method::centreline) {
    addCentreline(run.dataset, *readings, facts);
  } else {
    addAlignment(run.dataset, *readings, facts);
  }
}

// Which steps were jogs, and what the probe is said to be like.
void addSelftest(metrology::Dataset& dataset, const capture::Recording& recording, const Facts& facts) {
  metrology::Matrix gain;
  for (const auto& row : facts.gain) gain.emplace_back(row.begin(), row.end());
  dataset.config["gain"] = gain;
  auto steps = metrology::Table::withColumns("steps", metrology::kSelftestColumns);
  for (const auto& touch : recording.touches())
    steps.append({static_cast<double>(touch.request.step), touch.request.travel_mm});
  dataset.tables.push_back(std::move(steps));
}

}  // namespace

std::optional<Error> whyUnready(Method method, const Facts& facts, bool delay_in_force) {
  const std::string name{nameOf(method)};
  switch (needsOf(method)) {
    case Needs::nothing:
    case Needs::screw:  // sweepOptions() has asked
      return std::nullopt;
    case Needs::sphere_diameter:
      if (facts.sphere_diameter_mm) return std::nullopt;
      return Error{name +
                   " needs the size of the sphere: give [datum_sphere] diameter_mm in machine.toml, or use "
                   "delay-multi-speed, which finds it."};
    case Needs::plates_gap:
      if (facts.gap_mm) return std::nullopt;
      return Error{name + " needs the distance of the plates: give [datum_plates] gap_mm in machine.toml."};
    case Needs::delay_in_force:
      if (delay_in_force) return std::nullopt;
      return Error{name +
                   " needs the system delay, and none is in force: calibrate it first (probebox calibrate "
                   "delay-multi-speed) and accept it."};
  }
  return std::nullopt;
}

bool findsAPlace(Method method) {
  return method == Method::centreline || method == Method::c_axis_alignment;
}

RunDataset runDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts) {
  if (needsOf(method) == Needs::screw) return {sweepDataset(recording, scales, facts), std::nullopt};
  RunDataset run{capture::touchDataset(recording, scales, std::string{nameOf(method)}), std::nullopt};
  auto& config = run.dataset.config;
  switch (needsOf(method)) {
    case Needs::nothing:
    case Needs::screw:
      break;
    case Needs::sphere_diameter:
      if (facts.sphere_diameter_mm)
        config["effective_diameter_mm"] = *facts.sphere_diameter_mm + facts.stylus_ball_diameter_mm;
      if (method == Method::delay_known_sphere) config["feature"] = std::string{"external"};
      break;
    case Needs::plates_gap:
      if (facts.gap_mm) config["gap_mm"] = *facts.gap_mm;
      config["stylus_ball_diameter_mm"] = facts.stylus_ball_diameter_mm;
      config["feature"] = std::string{"internal"};
      break;
    case Needs::delay_in_force:
      addReadings(run, method, recording, facts);
      break;
  }
  if (method == Method::selftest) addSelftest(run.dataset, recording, facts);
  return run;
}

}  // namespace probebox::procedure
