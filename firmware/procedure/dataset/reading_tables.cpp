#include "firmware/procedure/dataset/reading_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "firmware/metrology/touch/ball_centre.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/rim_readings.hpp"
#include "firmware/procedure/dataset/shank_readings.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 3> kCentrelineColumns{"C_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 3> kRimColumns{"C_rad_clockwise_from_plus_y", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 4> kOffsetColumns{"A_rad", "C_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 5> kAlignmentColumns{"z_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
constexpr std::array<std::string_view, 6> kCheckColumns{"B_deg", "C_deg", "A_deg", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 4> kTopColumns{"B_deg", "C_deg", "A_deg", "z_mm"};
constexpr std::array<std::string_view, 5> kPlateColumns{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 5> kLengthColumns{"tip_length_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
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

// `column`: how C counts. It is right-handed about +Z where it is C_rad, and the other way round from +Y.
void addCentreline(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts,
                   std::span<const std::string_view> columns, double sense) {
  dataset.config["sigma_mm"] = sigmaOf(readings);
  dataset.config["sigma_C_rad"] = facts.sigma_c_rad;
  auto table = metrology::Table::withColumns("readings", columns);
  for (const auto& reading : readings)
    table.append({sense * reading.c_rad, reading.centre.centre_mm.x(), reading.centre.centre_mm.y()});
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

// The methods below have no key for an error of the angle. It acts in one direction of two; where every reading is a
// stop of C of its own, half of its variance belongs to each coordinate.
double sigmaWithAngle(const std::vector<Reading>& readings, const Facts& facts) {
  return std::hypot(sigmaOf(readings), reachOf(readings) * facts.sigma_c_rad / std::numbers::sqrt2);
}

void addOffset(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts) {
  dataset.config["sigma_mm"] = sigmaWithAngle(readings, facts);
  auto table = metrology::Table::withColumns("readings", kOffsetColumns);
  for (const auto& reading : readings)
    table.append({reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(), reading.centre.centre_mm.y()});
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

void addSpindleAlignment(metrology::Dataset& dataset, const std::vector<Reading>& readings,
                         const std::vector<ShankReading>& shank, const Facts& facts) {
  dataset.config["sigma_mm"] = sigmaWithAngle(readings, facts);
  dataset.config["tool_direction"] = -1.0;  // a spindle that holds its tool downwards
  auto table = metrology::Table::withColumns("readings", kLengthColumns);
  for (const auto& reading : readings) {
    table.append({facts.lengthOf(reading.tool), reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(),
                  reading.centre.centre_mm.y()});
  }
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
  if (!shank.empty()) addShankOfAlignment(dataset, shank, facts, reachOf(readings) * facts.sigma_c_rad);
}

void addAlignment(metrology::Dataset& dataset, std::vector<Reading> readings, const Facts& facts) {
  // Here the two readings of one stop of C share its error: for the mean of four that is one of its full size in each.
  dataset.config["sigma_mm"] = std::hypot(sigmaOf(readings), reachOf(readings) * facts.sigma_c_rad);
  std::ranges::stable_sort(readings, {}, [](const Reading& r) { return std::array{r.ball, r.c_rad, r.a_rad}; });
  auto table = metrology::Table::withColumns("readings", kAlignmentColumns);
  for (const auto& reading : readings) {
    table.append({heightOf(readings, reading.ball), reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(),
                  reading.centre.centre_mm.y()});
  }
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

// What a wrong delay adds to touches from one side, k = 1.
double delayError_mm(const capture::Recording& recording) {
  double speeds_mm_s = 0;
  for (const auto& touch : recording.touches()) speeds_mm_s += touch.request.retract_speed_mm_s;
  return speeds_mm_s / static_cast<double>(recording.touches().size()) * recording.delay().sd_s[2];
}

// The part of the check that needs no swivel. Z is that of the ball's top at C = 0: on a leaning axis the ball stands
// at another height at 180.
void addCheck(metrology::Dataset& dataset, const std::vector<Reading>& readings, const capture::Recording& recording,
              const Facts& facts) {
  auto& config = dataset.config;
  const CheckedBall& ball = *facts.checked_ball;
  auto centres = metrology::Table::withColumns("centres", kCheckColumns);
  auto tops = metrology::Table::withColumns("z_touch", kTopColumns);
  for (const auto& reading : readings) {
    const double c_deg = halfTurns_deg(reading.c_rad), a_deg = halfTurns_deg(reading.a_rad);
    const auto& at = reading.centre.centre_mm;
    centres.append({0, c_deg, a_deg, at.x(), at.y(), at.z()});
    if (c_deg == 0) tops.append({0, c_deg, a_deg, at.z() + reading.centre.radius_mm});
  }
  // The top is one touch, a centre in X or Y the middle of two. The tops share the delay's error, which their mean
  // keeps whole.
  const double of_delay_mm = std::sqrt(static_cast<double>(tops.rows())) * delayError_mm(recording);
  config["sigma_mm"] = sigmaWithAngle(readings, facts);
  config["sigma_touch_mm"] = std::hypot(std::numbers::sqrt2 * sigmaOf(readings), of_delay_mm);
  config["effective_ball_radius_mm"] = (ball.diameter_mm + facts.stylus_ball_diameter_mm) / 2;
  config["expected_ball_centre_z_mm"] = ball.centre_z_mm;
  config["x_is_radius"] = true;  // positions are, however X is programmed
  if (ball.accepted_x_mm) config["accepted_Xcen_B0_mm"] = *ball.accepted_x_mm;
  if (ball.accepted_y_mm) config["accepted_Ycen_B0_mm"] = *ball.accepted_y_mm;
  if (ball.limit_mm) config["limit_mm"] = *ball.limit_mm;
  dataset.tables.insert(dataset.tables.begin(), {centres, tops});
}

// In Z; what the delay does to the top of a ball it does at every stop alike, and the plate's place takes it along.
double axialSigmaOf(const std::vector<Reading>& readings) {
  double sum = 0;
  for (const auto& reading : readings) sum += reading.centre.sd_mm.z() * reading.centre.sd_mm.z();
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

// The centres of all readings of a run, and where its shank met a ball, with the delay that was in force taken out.
struct Found {
  std::vector<Reading> readings;
  std::vector<ShankReading> shank;
};
Outcome<Found, metrology::Refusal> readingsOf(const metrology::Dataset& touches, const capture::Recording& recording) {
  std::vector<std::size_t> reading_of_touch;
  Found found;
  auto& readings = found.readings;
  for (const auto& touch : recording.touches()) {
    const auto& at = touch.request;
    const bool by_shank = at.shank_height_mm > 0;
    reading_of_touch.push_back(by_shank ? metrology::kAlone : at.reading);
    if (by_shank || at.reading < readings.size()) continue;
    readings.push_back({.number = static_cast<double>(at.reading),
                        .ball = static_cast<double>(at.ball),
                        .a_rad = at.rotary_angles_rad[0],
                        .b_rad = at.rotary_angles_rad[1],
                        .c_rad = at.rotary_angles_rad[2],
                        .tool = at.tool,
                        .rim = at.rim,
                        .centre = {}});
  }
  const auto centres = metrology::ballCentres(touches, reading_of_touch, recording.delay().tau_s);
  if (!centres) return centres.error();
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i].centre = centres->readings[i];
  for (const auto& [touch, at_mm, sd_mm] : centres->alone) {
    const auto& at = recording.touches()[touch].request;
    const auto& [a_rad, b_rad, c_rad] = at.rotary_angles_rad;
    found.shank.push_back({.number = static_cast<double>(at.reading),
                           .side = vectorOf(at.outward_normal),
                           .a_rad = a_rad,
                           .b_rad = b_rad,
                           .c_rad = c_rad,
                           .at_mm = at_mm,
                           .sd_mm = sd_mm});
  }
  return found;
}

}  // namespace

void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts) {
  double balls = 0;
  for (const auto& reading : readings) balls = std::max(balls, reading.ball);
  const auto a_stop = static_cast<std::size_t>(balls);
  const double zero_rad = readings.back().c_rad;
  auto first = metrology::Table::withColumns("first", kPlateColumns);
  auto second = metrology::Table::withColumns("second", std::span{kPlateColumns}.last<4>());
  auto third = metrology::Table::withColumns("third", std::span{kPlateColumns}.last<4>());
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto& reading = readings[k];
    const auto& at = reading.centre.centre_mm;
    if (k + a_stop >= readings.size()) {
      second.append({reading.ball, at.x(), at.y(), at.z()});
    } else {
      // One stop is one angle, however finely the machine reads it.
      const double phi_rad = readings[k / a_stop * a_stop].c_rad - zero_rad;
      first.append({phi_rad, reading.ball, at.x(), at.y(), at.z()});
    }
  }
  for (std::size_t k = 0; k < std::min(a_stop, plate.balls_mm.size()); ++k) {
    const auto& at = plate.balls_mm[k];
    third.append({static_cast<double>(k + 1), at[0], at[1], at[2]});
  }
  auto& config = dataset.config;
  config["axis"] = std::string{"C"};
  config["axis_point_mm"] = std::vector<double>{plate.axis_point_mm.begin(), plate.axis_point_mm.end()};
  config["axis_direction"] = std::vector<double>{0, 0, 1};
  config["sigma_mm"] = sigmaOf(readings);
  config["sigma_axial_mm"] = axialSigmaOf(readings);
  if (facts.sigma_c_rad > 0) config["sigma_angle_rad"] = facts.sigma_c_rad;
  if (plate.sd_mm) config["sigma_third_mm"] = *plate.sd_mm;
  dataset.tables.insert(dataset.tables.begin(), {first, second, third});
}

std::optional<metrology::Refusal> addReadings(metrology::Dataset& dataset, Method method,
                                              const capture::Recording& recording, const Facts& facts) {
  dataset.tables.push_back(posesOf(recording));
  const auto& delay = recording.delay();
  if (delay.result_id == 0) {
    return metrology::Refusal{"no-delay",
                              "no system delay is in force, so the touches are displaced from the surface by an "
                              "unknown lag: calibrate the delay first, accept it, and measure again"};
  }
  dataset.config["previous_tau_axis_s"] = std::vector<double>{delay.tau_s.begin(), delay.tau_s.end()};
  auto found = readingsOf(dataset, recording);
  if (!found) return found.error();
  auto& [readings, shank] = *found;
  if (auto refusal = centreTouches(shank, readings, facts)) return refusal;
  // The check has a table of this name itself, of its own columns.
  if (method == Method::periodic_check) {
    addCheck(dataset, readings, recording, facts);
    return std::nullopt;
  }
  dataset.tables.push_back(centresOf(readings));
  switch (method) {
    case Method::centreline:
      addCentreline(dataset, readings, facts, kCentrelineColumns, 1);
      break;
    case Method::centreline_limited_access:
      addCentreline(dataset, readings, facts, kRimColumns, -1);
      break;
    case Method::centreline_by_steps:
      addRimSteps(dataset, readings, facts);
      break;
    case Method::rotary_axis_errors:
      addPlate(dataset, readings, *facts.ball_plate, facts);
      break;
    case Method::c_axis_alignment:
      addAlignment(dataset, readings, facts);
      break;
    case Method::table_pivot:
      addTilts(dataset, readings, facts.tilting_table.value_or(BFacts{}));
      break;
    case Method::swivel_error:
      addSwivelErrors(dataset, readings, facts);
      if (!shank.empty()) addShankOfSwivel(dataset, shank, facts);
      break;
    case Method::head_pivot:
      addSwivels(dataset, readings, facts.swivel_head.value_or(HeadFacts{}));
      break;
    case Method::a_axis_alignment:
      addSpindleAlignment(dataset, readings, shank, facts);
      break;
    default:
      addOffset(dataset, readings, facts);
  }
  return std::nullopt;
}

}  // namespace probebox::procedure
