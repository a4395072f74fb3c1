#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A ball on the rim of a large chuck that the probe reaches over an arc only (CN101976057 equations 7 to 11,
// docs/metrology.md B.11). C counts clockwise from +Y here: ball = centre + R (sin(C + psi), cos(C + psi)).

// (B26): correction of the zero of C from readings at C = +theta and -theta, so that the ball lies on +Y at zero.
double remainingShift(const Eigen::Vector2d& at_plus, const Eigen::Vector2d& at_minus);

// (B27): centre and radius from readings at +theta, -theta and 0 with psi = 0. nullopt when the readings at 0 and
// +theta have the same height.
struct RimCentre {
  Eigen::Vector2d centre;  // mm
  double radius{};         // mm, signed
};
std::optional<RimCentre> rimCentre(const Eigen::Vector2d& at_plus, const Eigen::Vector2d& at_minus,
                                   const Eigen::Vector2d& at_zero);

struct RimReading {
  Eigen::Vector2d at;  // mm
  double c{};          // rad, clockwise from +Y
};

// Readings at +theta, -theta and 0, mm.
struct RimSteps {
  Eigen::Vector2d plus;
  Eigen::Vector2d minus;
  Eigen::Vector2d zero;  // the origin where it was not read
  double theta{};        // rad
  bool zero_read{};
};

// Those of the readings that (B26) and (B27) need, whole turns aside: theta is the largest angle, the others are the
// nearest to -theta and 0. Each is turned from the angle it reports to the nominal one, about the centre (B5) of the
// first two: beside its angle by 1 mrad a ball at 600 mm is 0.6 mm away. nullopt: no reading within kSameStop_rad of
// -theta.
std::optional<RimSteps> rimStepsOf(std::span<const RimReading> readings);

// (B26), (B27) without moving the machine: turns the readings instead of C. nullopt as above.
std::optional<RimCentre> turnedRimCentre(const RimSteps& steps);

// Method "centreline-limited-access": all readings by least squares with their known angles (B6), weighted for the
// noise of C (B8). Table readings{C_rad_clockwise_from_plus_y,x_mm,y_mm}. Config: sigma_mm, sigma_C_rad. Gives
// centre_mm, radius_mm, psi0_rad. If the data hold the readings of the source's steps (B26), (B27), these are computed
// as well: also source_centre_mm, with a warning when the two disagree. Refuses: arc-too-short (less than 15 degrees to
// either side), and what fitRotation does.
Outcome<Result, Refusal> solveCentrelineLimitedAccess(const Dataset& dataset);

// Method "c-zero-shift": error of the zero of C, from the angles at which the ball touches a stylus on either side of
// the nominal line (B25). Table contacts{C1_rad,C2_rad}, signed, one row per repetition. Config: sigma_C_rad, of
// one contact. Gives C_shift_rad, in the turn of C1_rad of the first row. Refuses: not-opposite (both contacts at one
// angle, or more than a third of a turn apart).
Outcome<Result, Refusal> solveCZeroShift(const Dataset& dataset);

namespace quantity {
inline constexpr Quantity kCShift{.key = "C_shift_rad", .about = "new zero of C in the old count"};
}

extern const Method kCentrelineLimitedAccess;
extern const Method kCZeroShift;

}  // namespace probebox::metrology
