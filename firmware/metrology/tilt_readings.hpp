#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/least_squares.hpp"
#include "firmware/metrology/result.hpp"
#include "firmware/metrology/swivel_plane.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A point that tilts about the pivot. Points that differ by the angle of the other axis are points of their own: each
// turns about the pivot at its own arm, so nothing needs to cancel.
struct TiltReading {
  Eigen::Vector2d at;  // mm, in the plane across the axis
  double tilt_deg{};   // right-handed about the axis
  double along{};      // mm, along the axis, from the mean of all readings
  std::size_t point{};
};

struct TiltReadings {
  std::vector<TiltReading> readings;
  double mean_along{};  // mm, machine coordinate
};

// Rows of a checked table of readings: {tilt_deg,C_deg,..} of a tilting table, or {B_deg,A_deg,..} of a swivelling head
// when the place of its ball is given; then the points are ball minus reading (B30).
TiltReadings tiltReadings(const Table& table, const SwivelPlane& plane, const Eigen::Vector3d* ball);

// What tables "readings" and configurations hold, of a tilting table and of a swivelling head.
inline constexpr std::array<std::string_view, 5> kTableTiltColumns{"tilt_deg", "C_deg", "x_mm", "y_mm", "z_mm"};
inline constexpr std::array<std::string_view, 5> kHeadTiltColumns{"B_deg", "A_deg", "x_mm", "y_mm", "z_mm"};
inline constexpr std::array<std::string_view, 2> kTableTiltKeys{"tilt_axis", "sigma_mm"};
inline constexpr std::array<std::string_view, 3> kHeadTiltKeys{"ball_mm", "swivel_axis", "sigma_mm"};
// Of methods in the plane, beside these.
inline constexpr std::string_view kSigmaAngle = "sigma_angle_rad";

// Where the ball of a swivelling head stands, config key ball_mm. Refuses: missing-key, bad-config.
Outcome<Eigen::Vector3d, Refusal> tiltedBall(const Dataset& dataset);

// (B29): pivot half way along the readings, then each point's arm at tilt zero; with `skew` also how far the pivot
// moves for each mm along the axis. sigma: mm, of one coordinate; sigma_angle: rad, of a stop of the axis, which moves
// a reading across its arm: where it is not zero, the rows of a reading are along its arm and across, scaled to sigma.
// Refuses tilts within 20 degrees (tilt-span-too-small), and as below.
Outcome<Fit, Refusal> fitTilts(const std::vector<TiltReading>& readings, bool skew, double sigma,
                               double sigma_angle = 0.0);

// Refuses a fit whose first two parameters, the pivot, are 20 times less certain than the mean of the readings, or that
// is ill-conditioned: tilt-span-too-small.
Outcome<Fit, Refusal> refuseUncertainPivot(Outcome<Fit, Refusal> fit, std::size_t readings, double sigma);

// Refuses arm-too-short: no point further from the axis than 5 sigma.
std::optional<Refusal> refuseArm(double longest_mm, const Sigma& sigma);

}  // namespace probebox::metrology
