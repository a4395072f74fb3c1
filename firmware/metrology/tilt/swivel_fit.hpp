#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/tilt/swivel_readings.hpp"
#include "protocol/units/outcome.hpp"

// Linear model of the ball positions that a swivelling head produces, and its fit (docs/metrology.md B.8).
namespace probebox::metrology {

// Columns of the tables readings and shank of swivel-error.
inline constexpr MethodColumn kSwivelColumns[]{column::kB, column::kToolLength, column::kX, column::kY, column::kZ};
inline constexpr MethodColumn kShankColumns[]{column::kB,    column::kToolLength, column::kSetX,   column::kSetY,
                                              column::kSetZ, column::kAlongX,     column::kAlongY, column::kAlongZ};

enum class SwivelKind { sine, rigid, free };

// E = terms(B, L) * p.
struct SwivelModel {
  SwivelKind kind{SwivelKind::rigid};
  SwivelPlane plane;
  bool one_minus_cosine{true};  // fitted along the axis; one angle alone cannot separate it from the sine
  // The component of t that is omitted because it is along the tool, where a shank does not measure.
  std::optional<Eigen::Index> without{};

  Eigen::Index parameters() const;
  // The common form of all three models, as a linear map of the parameters: for x, y and z the factors of sin B,
  // L sin B, 1 - cos B and L (1 - cos B). Shape: 12 x parameters().
  Eigen::MatrixXd map() const;
  Eigen::MatrixXd terms(double swivel_deg, double length_mm) const;  // 3 x parameters()
  // Direction t of (B20) for a rigid head, in the order of the plane's axes. Shape: 2 x parameters().
  Eigen::MatrixXd direction() const;
};

// Tables readings{B_deg,L_mm,x_mm,y_mm,z_mm} and, where a shank touched, shank{..,ux,uy,uz}. Refuses:
// length-span-too-small (10 mm), swivel-angle-too-small (|sin B| < 0.2), bad-axis (a shank whose head swivels about Z),
// several-tips, bad-direction, not-opposed, and what checkedTable refuses.
Outcome<SwivelReadings, Refusal> readSwivelReadings(const Dataset& dataset, const SwivelPlane& plane);

// Tips at one stop of B, as measured: angles within kSameStop_deg of the first, whole turns aside.
struct SwivelStop {
  double swivel_deg{};            // mean
  std::vector<std::size_t> tips;  // rows of SwivelReadings::tips

  bool level() const;  // within kPoseTolerance_deg of zero
};

// In rising order of the angle.
std::vector<SwivelStop> swivelStops(const SwivelReadings& readings);

// Number of stops that are not level: two separate sin B from 1 - cos B.
std::size_t swivelAngles(const SwivelReadings& readings);

// Design matrix: three rows per reading of a tip, then one per touch of the shank, in units of the sd of a tip's
// coordinate, apart from the spreads. Parameters: those of the model, the reported ball at B = 0 for each length, and
// for a shank its different report along the axis at B = 0 and the sum of both radii. Tip and shank of one tool share
// the ball, so that in the plane their reports differ only by the effect of the tool's direction on their lengths.
Eigen::MatrixXd swivelDesign(const SwivelReadings& readings, const SwivelModel& model);
// What the rows of the design are to be, mm.
Eigen::VectorXd swivelValues(const SwivelReadings& readings, Eigen::Index axis);
// sigma: mm, of a coordinate of a tip.
Outcome<Fit, Refusal> fitSwivel(const SwivelReadings& readings, const SwivelModel& model, double sigma);
// Extends `found`, the fit of a rigid head without 1 - cos B to readings at one angle. Along the axis its error may
// follow sin B, which is answered, or 1 - cos B: adds two parameters for the latter, zero with an sd as large as the
// error found at the shortest and the longest tool. The fit of the readings does not change.
Outcome<Fit, Refusal> fitEitherShape(const SwivelReadings& readings, SwivelModel model, const Fit& found,
                                     const Sigma& sigma);

}  // namespace probebox::metrology
