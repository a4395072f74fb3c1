#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

// Linear model of the ball positions that a swivelling head produces, and its fit (docs/metrology.md B.8).
namespace probebox::metrology {

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
  // Of a rigid head: t of (B20), in the plane's order. Shape: 2 x parameters().
  Eigen::MatrixXd direction() const;
};

struct SwivelReading {
  double swivel_deg{};
  double length_mm{};
  Eigen::Vector3d at;
};

// The mean of two touches with the shank, the spindle turned by 180 degrees between them, as (B16) has it: it counts
// along `side` alone, a unit vector from the ball, where ball and shank add their radii.
struct ShankTouch {
  SwivelReading reading;
  Eigen::Vector3d side;
};

struct SwivelReadings {
  std::vector<SwivelReading> tips;
  std::vector<ShankTouch> shank;  // of one tool with the tip, which is then the only one
  // In the sd of a coordinate of a tip across the swivel axis: of a touch with the shank, and of a tip's along the
  // axis.
  double shank_spread{1.0};
  double along_spread{1.0};

  bool byShank() const { return !shank.empty(); }
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

// Three rows a tip's reading, then one a touch of the shank; in units of the sd of a coordinate of a tip, but for
// the spreads. Parameters: those of the model, the ball as reported at B = 0 for each length, and of a shank what it
// reports otherwise along the axis at B = 0, and both radii together. The ball is one for tip and shank of one tool, so
// that in the plane these two report what the direction of the tool makes of their lengths.
Eigen::MatrixXd swivelDesign(const SwivelReadings& readings, const SwivelModel& model);
// sigma: mm, of a coordinate of a tip.
Outcome<Fit, Refusal> fitSwivel(const SwivelReadings& readings, const SwivelModel& model, double sigma);
// From one angle, of which `found` is the fit of a rigid head without 1 - cos B. Along the axis all that it shows may
// follow sin B, which is answered, or 1 - cos B: two more parameters, zero with a deviation of what was found at the
// shortest and the longest tool. The readings are fitted as before.
Outcome<Fit, Refusal> fitEitherShape(const SwivelReadings& readings, SwivelModel model, const Fit& found,
                                     const Sigma& sigma);

}  // namespace probebox::metrology
