#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A reading of a point that tilts about the pivot. Each stop of the other axis (angles within kSameStop_deg of its
// first) makes a separate point with an arm of its own, so errors of that axis need not cancel.
struct TiltReading {
  Eigen::Vector2d at;  // mm, in the plane across the axis
  double tilt_deg{};   // right-handed about the axis
  double along{};      // mm, along the axis, from TiltReadings::centre_along
  std::size_t point{};
  std::size_t stop{};  // of the axis: readings in a row whose tilts are within kSameStop_deg of the first
};

struct TiltReadings {
  std::vector<TiltReading> readings;
  // mm, machine coordinate: position of the other axis, around which the points lie. If their angles do not determine
  // it (one or two angles, or all on one side), the mean of the points.
  double centre_along{};
  double apart_deg{};  // largest difference of the other axis' angles within one point
};

// Rows of a checked table of readings: {tilt_deg,C_deg,..} of a tilting table, or {B_deg,A_deg,..} of a swivelling head
// when the place of its ball is given; then the points are ball minus reading (B30).
TiltReadings tiltReadings(const Table& table, const SwivelPlane& plane, const Eigen::Vector3d* ball);

// The sentence about angles of the other axis that move the readings of one point against each other: from a digit of a
// control on, 0.001 degrees, a micrometre 60 mm beside that axis.
std::optional<std::string> anglesApart(const TiltReadings& tilts);

// Columns of the tables "readings", and keys, of a tilting table and of a swivelling head.
inline constexpr MethodColumn kTilt{"tilt_deg", ColumnRole::angle, column::kMostTilt_deg};
inline constexpr MethodColumn kTableTiltColumns[]{kTilt, column::kCDegrees, column::kX, column::kY, column::kZ};
inline constexpr MethodColumn kHeadTiltColumns[]{column::kB, column::kADegrees, column::kX, column::kY, column::kZ};

// Parts of the descriptors of both pairs of methods.
inline constexpr MethodTable kTableTiltTables[]{
    {"readings", kTableTiltColumns, "centre of one ball at a tilt and C", true}};
inline constexpr MethodTable kHeadTiltTables[]{
    {"readings", kHeadTiltColumns, "machine position with the stylus at the ball, at B and A of the spindle", true}};
inline constexpr MethodKey kTableTiltKeys[]{{"tilt_axis", kNeeded, "unit vector of the tilt axis, along X, Y or Z"},
                                            key::kSigma,
                                            key::kSigmaAngle,
                                            key::kTauForTheRecord};
inline constexpr MethodKey kHeadTiltKeys[]{{"ball_mm", kNeeded, "where the ball is, x y z"},
                                           key::kSwivelAxis,
                                           key::kSigma,
                                           key::kSigmaAngle,
                                           key::kTauForTheRecord};
inline constexpr KnownQuantity kBallKnown[]{
    {"sd_ball_mm", "ball_mm", KnownKind::value, false, "position of the datum sphere"}};
inline constexpr std::string_view kTableTiltUnobservable[]{
    "the position of the pivot along the tilt axis, and first harmonics of the tilt axis separately from its position"};
inline constexpr std::string_view kHeadTiltUnobservable[]{
    "the position of the pivot along the swivel axis",
    "an error of ball_mm: it biases the pivot with unit sensitivity"};

// Noise of one coordinate of a reading and, if stated, of the angle of a stop, which displaces all readings of the stop
// across their arms.
struct TiltNoise {
  Sigma position;  // sigma_mm
  double angle{};  // rad, sigma_angle_rad; 0 without sigma_mm beside it
  std::vector<std::string> warnings;
};

// Refuses: bad-config.
Outcome<TiltNoise, Refusal> tiltNoise(const Dataset& dataset);

// Reads the position of the ball of a swivelling head, config key ball_mm. Refuses: missing-key, bad-config.
Outcome<Eigen::Vector3d, Refusal> tiltedBall(const Dataset& dataset);

// (B29): pivot at the centre of the readings along the axis, then each point's arm at tilt zero; with `skew` also how
// far the pivot moves for each mm along the axis. The common error of each stop is removed from the residuals
// (withoutStops). Refuses tilts within 20 degrees (tilt-span-too-small), and as below.
Outcome<Fit, Refusal> fitTilts(const std::vector<TiltReading>& readings, bool skew, const TiltNoise& noise);

// Removes the common error of every stop from the rows, so that their noise is independent with unit sd. per_radian:
// change of each row per radian of its stop, in sd of a reading; each reading has the same number of rows.
Linearised withoutStops(Linearised rows, const std::vector<TiltReading>& readings, const Eigen::VectorXd& per_radian,
                        double sigma_angle);

// Refuses a fit whose first two parameters, the pivot, are 20 times less certain than the mean of the readings, or that
// is ill-conditioned: tilt-span-too-small.
Outcome<Fit, Refusal> refuseUncertainPivot(Outcome<Fit, Refusal> fit, std::size_t readings, double sigma);

// Refuses arm-too-short: no point further from the axis than 5 sigma.
std::optional<Refusal> refuseArm(double longest_mm, const Sigma& sigma);

}  // namespace probebox::metrology
