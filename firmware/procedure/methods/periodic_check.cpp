#include "firmware/metrology/centreline/periodic_check.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 6> kCheckColumns{"B_deg", "C_deg", "A_deg", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 4> kTopColumns{"B_deg", "C_deg", "A_deg", "z_mm"};

constexpr Fact kCheckedBall{
    .place = "`[periodic_check]`",
    .known = [](const Facts& facts) { return facts.checked_ball.has_value(); },
    .missing =
        "a description of the ball: give [periodic_check] ball_diameter_mm and ball_centre_z_mm in machine.toml."};
constexpr std::array kNeedsOfPeriodicCheck{&kCheckedBall};

// What a wrong delay adds to touches from one side, k = 1.
double delayError_mm(const capture::Recording& recording) {
  double speeds_mm_s = 0;
  for (const auto& touch : recording.touches()) speeds_mm_s += touch.request.retract_speed_mm_s;
  return speeds_mm_s / static_cast<double>(recording.touches().size()) * recording.delay().sd_s[2];
}

// The part of the check that needs no swivel. Z is that of the ball's top at C = 0: on a leaning axis the ball stands
// at another height at 180.
void addCheck(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  const auto& [readings, shank] = found;
  const Facts& facts = run.facts;
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
  const double of_delay_mm = std::sqrt(static_cast<double>(tops.rows())) * delayError_mm(run.recording);
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

}  // namespace

constinit const LiveMethod kPeriodicCheck{
    .number = 14,
    .solver = &metrology::kPeriodicCheck,
    .steps = "one ball, A and C at 0 and 180 degrees independently, five touches each; what needs no swivel (B = 0)",
    .needs = kNeedsOfPeriodicCheck,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTwoByTwo,
    .usual = readings(),
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addCheck); }};

}  // namespace probebox::procedure
