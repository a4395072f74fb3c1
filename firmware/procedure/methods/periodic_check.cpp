#include "firmware/metrology/centreline/periodic_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kCheckedBall{
    .place = "`[periodic_check]`",
    .known = [](const Facts& facts) { return facts.checked_ball.has_value(); },
    .missing =
        "a description of the ball: give [periodic_check] ball_diameter_mm and ball_centre_z_mm in machine.toml."};
constexpr std::array kNeedsOfPeriodicCheck{&kCheckedBall};

// Displacement of one-sided touches by the uncertainty of the delay (k = 1): all outwards by the same amount, like an
// error of the radius.
double delayError_mm(const capture::Recording& recording) {
  double speeds_mm_s = 0;
  for (const auto& touch : recording.touches()) speeds_mm_s += touch.request.retract_speed_mm_s;
  return speeds_mm_s / static_cast<double>(recording.touches().size()) * recording.delay().sd_s[2];
}

// By how much the nominal kinematics of the head displace the tip along X from where it is at B = 0.
double swungX_mm(const Facts& facts, double b_rad) {
  if (b_rad == 0 || !facts.swivel_head) return 0;
  const double length_mm = facts.lengthOf(facts.probe_tools.numbers[0]);
  return (nominalTip(*facts.swivel_head, b_rad, length_mm) - nominalTip(*facts.swivel_head, 0, length_mm)).x();
}

// From the axis of the head to the tip.
double armOfHead_mm(const Facts& facts) {
  const HeadFacts& head = *facts.swivel_head;
  const double length_mm = facts.lengthOf(facts.probe_tools.numbers[0]);
  return (nominalTip(head, 0, length_mm) - vectorOf(head.pivot_mm)).norm();
}

// Angles of B to the digits at which the check is defined; others as they are, for the solver to refuse.
double checkAngle_deg(double b_rad) {
  const double near_deg = 45 * std::round(degrees(b_rad) / 45);
  return std::abs(degrees(b_rad) - near_deg) < degrees(kPoseTolerance_rad) ? near_deg : degrees(b_rad);
}

// What is touched by a lathe of X and Z is a section of the ball, smaller than it by as much as the ball stands beside
// the plane of the stylus: the height of its middle is that of the ball, the top is not. So the top is reckoned from
// there.
double topOf_mm(const Reading& reading, const Facts& facts) {
  const double radius_mm =
      facts.has_y ? reading.centre.radius_mm : (facts.checked_ball->diameter_mm + facts.stylus_ball_diameter_mm) / 2;
  return reading.centre.centre_mm.z() + radius_mm;
}

struct CheckTables {
  metrology::Table centres{metrology::emptyTable(metrology::kPeriodicCheck, "centres", {metrology::column::kY.name})};
  metrology::Table x_touch{metrology::emptyTable(metrology::kPeriodicCheck, "x_touch")};
  metrology::Table z_touch{metrology::emptyTable(metrology::kPeriodicCheck, "z_touch")};
};

// Z is that of the ball's top at B = 0 and C = 0: on a leaning axis the ball stands at another height at 180. X is that
// of its side at B = 90, where the stylus lies along X, from the accepted turning axis.
CheckTables checkTables(const std::vector<Reading>& readings, const Facts& facts) {
  CheckTables tables;
  if (!facts.has_y) tables.centres = metrology::emptyTable(metrology::kPeriodicCheck, "centres");
  std::vector<Reading> at_top, at_side;
  const double axis_mm = facts.checked_ball->accepted_x.value_or(AcceptedValue{}).mm;
  for (const auto& reading : readings) {
    const double c_deg = halfTurns_deg(reading.c_rad), a_deg = halfTurns_deg(reading.a_rad);
    const double b_deg = checkAngle_deg(reading.b_rad);
    const auto& at = reading.centre.centre_mm;
    const double x_mm = at.x() + swungX_mm(facts, reading.b_rad);
    if (facts.has_y) {
      tables.centres.append({b_deg, c_deg, a_deg, x_mm, at.y(), at.z()});
    } else {
      tables.centres.append({b_deg, c_deg, a_deg, x_mm, at.z()});
    }
    if (b_deg == 0 && c_deg == 0) {
      tables.z_touch.append({b_deg, c_deg, a_deg, topOf_mm(reading, facts)});
      at_top.push_back(reading);
    }
    if (b_deg != 90) continue;
    tables.x_touch.append({b_deg, c_deg, a_deg, x_mm + reading.centre.radius_mm - axis_mm});
    at_side.push_back(reading);
  }
  tables.centres.columns.push_back(timesOf(readings));
  tables.z_touch.columns.push_back(timesOf(at_top));
  tables.x_touch.columns.push_back(timesOf(at_side));
  return tables;
}

// Standard deviation of the height of one centre at B = 90, where the side of the stem cannot be touched; 0 without
// such readings.
double sigmaOfHeight90(const std::vector<Reading>& readings) {
  double squares = 0, count = 0;
  for (const auto& reading : readings) {
    if (checkAngle_deg(reading.b_rad) != 90) continue;
    squares += reading.centre.sd_mm.z() * reading.centre.sd_mm.z();
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

void addAccepted(metrology::Dataset& dataset, const std::vector<Reading>& readings, const CheckedBall& ball,
                 bool has_y) {
  const auto add = [&config = dataset.config](const std::string& key, const std::optional<AcceptedValue>& value) {
    if (!value) return;
    config["accepted_" + key] = value->mm;
    if (value->sd_mm > 0) config["sd_accepted_" + key] = value->sd_mm;
  };
  add("Xcen_B0_mm", ball.accepted_x);
  if (!has_y) return;
  add("Ycen_B0_mm", ball.accepted_y);
  // X at B = 90 counts from accepted_x, whose error cancels against the X of a check that counted from it as well.
  add("x_offset_error_mm", ball.accepted_x90);
  add("Zcen_B90_mm", ball.accepted_z90);
  if (!ball.accepted_x90 && dataset.table("x_touch") && ball.accepted_x && ball.accepted_x->sd_mm > 0)
    dataset.config["sd_accepted_x_offset_error_mm"] = ball.accepted_x->sd_mm;
  if (!ball.accepted_y) return;
  // A value at an angle that is not read now is missed only where it was accepted at that angle.
  const auto isRead = [&](double b_deg) {
    return std::ranges::any_of(readings, [&](const Reading& r) { return checkAngle_deg(r.b_rad) == b_deg; });
  };
  if (ball.accepted_y45 || isRead(45)) add("Ycen_B45_mm", ball.accepted_y45 ? ball.accepted_y45 : ball.accepted_y);
  if (ball.accepted_y90 || isRead(90)) add("Ycen_B90_mm", ball.accepted_y90 ? ball.accepted_y90 : ball.accepted_y);
}

// Of X alone; of the height of a middle in place of a touch. How far the ball is from C in Y, by which a stop of C
// moves X, no reading tells: near the axis, as on a rod in the chuck, that is nothing.
void addSigmasOfXZ(metrology::Dataset& dataset, const std::vector<Reading>& level) {
  double x = 0, z = 0;
  for (const auto& reading : level) {
    x += reading.centre.sd_mm.x() * reading.centre.sd_mm.x();
    z += reading.centre.sd_mm.z() * reading.centre.sd_mm.z();
  }
  const auto count = static_cast<double>(level.size());
  dataset.config["sigma_mm"] = std::sqrt(x / count);
  dataset.config["sigma_touch_mm"] = std::sqrt(z / count);
  dataset.config.erase("sigma_C_rad");
  dataset.config["machine_axes"] = std::string{"XZ"};
}

void addCheck(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  const auto& [readings, shank, dropped] = found;
  const Facts& facts = run.facts;
  auto& config = dataset.config;
  const CheckedBall& ball = *facts.checked_ball;
  auto tables = checkTables(readings, facts);
  // The top is one touch, a centre in X or Y the middle of two, as is Y with the head swivelled.
  std::vector<Reading> level;
  std::ranges::copy_if(readings, std::back_inserter(level),
                       [](const Reading& reading) { return checkAngle_deg(reading.b_rad) == 0; });
  addSigmas(dataset, level, facts);
  config["sigma_touch_mm"] = std::numbers::sqrt2 * sigmaOf(level);
  if (!facts.has_y) addSigmasOfXZ(dataset, level);
  if (const double sigma_mm = sigmaOfHeight90(readings); sigma_mm > 0) config["sigma_Zcen_B90_mm"] = sigma_mm;
  if (tables.x_touch.rows() > 0 && facts.swivel_head && facts.swivel_head->b.sigma_rad > 0)
    config["sigma_stop_B90_mm"] = armOfHead_mm(facts) * facts.swivel_head->b.sigma_rad;
  // Common to all touches, so their scatter does not show it.
  const double sd_radius_mm = std::hypot(delayError_mm(run.recording), facts.sd_stylus_ball_diameter_mm.value_or(0) / 2,
                                         ball.sd_diameter_mm / 2);
  // The middle of a section counts from both its sides and its top, which are displaced alike.
  if (sd_radius_mm > 0 && facts.has_y) config["sd_effective_ball_radius_mm"] = sd_radius_mm;
  addStylusBall(dataset, facts);
  config["effective_ball_radius_mm"] = (ball.diameter_mm + facts.stylus_ball_diameter_mm) / 2;
  config["expected_ball_centre_z_mm"] = ball.centre_z.mm;
  if (ball.centre_z.sd_mm > 0) config["sd_expected_ball_centre_z_mm"] = ball.centre_z.sd_mm;
  config["x_is_radius"] = true;  // positions are, however X is programmed
  if (ball.limit_mm) config["limit_mm"] = *ball.limit_mm;
  dataset.tables.insert(dataset.tables.begin(), {std::move(tables.centres), std::move(tables.z_touch)});
  if (tables.x_touch.rows() > 0) addLengthResults(dataset, facts, {facts.probe_tools.numbers[0]});
  if (tables.x_touch.rows() > 0) dataset.tables.insert(dataset.tables.begin() + 1, std::move(tables.x_touch));
  addAccepted(dataset, readings, ball, facts.has_y);
}

// C at 0, 180, 180 and 0 of a lathe, whose turret turns no stylus: what drifts evenly cancels.
Pose forthAndBack(std::size_t index) {
  return {{0, 0, index == 1 || index == 2 ? kHalfTurn_rad : 0.0}, 1};
}

// The four poses of A and C at every angle of the head.
constexpr Poses kTwoByTwoAtEveryB{
    .count = [](const ProcedureOptions& options, const LoopState&) { return 4 * anglesOfB(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const auto angles = anglesOfB(options);
          Pose pose = options.faces == kFacesAcrossY ? forthAndBack(index) : twoByTwo(index % 4);
          pose.angles_rad[1] = angles[index / 4];
          pose.b_moves = angles.size() > 1 ? BMoves::head : BMoves::nothing;
          return pose;
        }};

Outcome<ProcedureOptions> checkOptions(ProcedureOptions options, const Facts& facts) {
  const auto& ball = facts.checked_ball;
  if (!ball || ball->swivels_rad.empty() || !facts.swivel_head) return options;
  if (facts.probe_tools.count == 0)
    return Error{
        "periodic-check with the head swivelled needs the length of the probe: give [probe_tools] numbers in "
        "machine.toml, and the [[tool]] of each."};
  if (!ball->accepted_x)
    return Error{
        "periodic-check with the head swivelled needs the turning axis from which X counts: give "
        "[periodic_check] accepted_x_mm in machine.toml, or accept a check at B = 0 first."};
  options.b_count = static_cast<std::uint8_t>(1 + ball->swivels_rad.size());
  options.b_angles_rad[0] = 0;
  std::ranges::copy(ball->swivels_rad, options.b_angles_rad.begin() + 1);
  options.b_axis = facts.swivel_head->b.axis;
  return options;
}

}  // namespace

constinit const LiveMethod kPeriodicCheck{
    .number = 14,
    .solver = &metrology::kPeriodicCheck,
    .steps =
        "one ball, A and C at 0 and 180 degrees independently, five touches each, at B = 0; the same with the head at "
        "45 and 90 degrees where `swivels_deg` says so; on a lathe of X and Z C at 0, 180, 180 and 0, three touches "
        "each",
    .needs = kNeedsOfPeriodicCheck,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTwoByTwoAtEveryB,
    .usual = with(readings(),
                  [](auto& options) {
                    options.b_count = 1;
                    options.b_axis = {0, 1, 0};
                  }),
    .closes = 1,
    .described = checkOptions,
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addCheck); }};

}  // namespace probebox::procedure
