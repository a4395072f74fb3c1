#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A feature turned about an axis, measured in the plane across it.
struct RotationReading {
  Eigen::Vector2d at;  // mm
  double angle{};      // rad, right-handed
};

// Uncertainty of one reading (k = 1).
struct RotationNoise {
  double position{1.0};  // mm, of one coordinate; 1 gives the cofactor
  double angle{};        // rad, of the axis
};

// Fits (B6): p = c + R2(angle) r; fit.parameters: c, r. With noise of the angle (B8) the angle of every stop is
// fitted too, but not returned: large noise makes this a circle fit, none makes it linear. Two angles: (B5). sd of
// c: (B7), sigma^2 / (N (1 - |w|^2)), w the mean of exp(i angle). Refuses: too-few-readings (2), angles-too-close
// (|sin(alpha/2)| < 0.05 for two readings, |w|^2 > 0.999 for more), and what leastSquares refuses.
Outcome<Fit, Refusal> fitRotation(std::span<const RotationReading> readings, const RotationNoise& noise);

// Number of the stop of each reading: each change of the angle from one reading to the next begins a stop
// (kSameStop_rad).
std::vector<double> stopsByAngle(std::span<const double> angles_rad);

// Method "centreline": centre of rotation of C from one feature read at two or more angles (CN101976057 figures 1 and
// 2, docs/metrology.md B.2, B.3). Table readings{C_rad,x_mm,y_mm}. Config: sigma_mm; sigma_C_rad, of the axis' angle,
// which is used only together with sigma_mm; C_sense. Gives centre_mm; also arm_mm, the vector from the centre to the
// feature at C = 0. Refuses what fitRotation does.
Outcome<Result, Refusal> solveCentreline(const Dataset& dataset);

// The turning axis from the tip, of the chuck that the case names.
std::optional<Subject> subjectOfCentreline(const Dataset& dataset);

// About the chuck that the key `spindle` names; the main one without it.
Subject subjectOfSpindle(const Dataset& dataset, SubjectKind kind);

// Refuses a key `spindle` that names neither the main chuck nor the second one: bad-config.
std::optional<Refusal> refuseSpindle(const Dataset& dataset);

// The height at which a centre was measured, where the case states it (mean_z_mm). Refuses: bad-config.
std::optional<Refusal> addMeanHeight(const Dataset& dataset, Result& result);

// Refuses a stylus that is further off the spindle axis than any is, 10 mm: implausible. remedy: what to check.
std::optional<Refusal> refuseStylusOff(double off_mm, std::string_view where, std::string_view remedy);

// Names of the two rows of a reading in that fit, and the sign that turns its residuals into measured minus fitted.
std::span<const std::string_view> residualParts(const RotationNoise& noise);
double residualSense(const RotationNoise& noise);

// sigma_mm and sigma_C_rad of a case. Refuses: bad-config.
struct StatedNoise {
  RotationNoise noise;
  bool stated{};
  std::vector<std::string> warnings;  // sigma_C_rad without sigma_mm

  Sigma sigma() const { return {noise.position, stated}; }
};
Outcome<StatedNoise, Refusal> statedNoise(const Dataset& dataset);

// Quantities that none of the three centreline methods can observe.
extern const std::string_view kCentrelineUnobservable[2];

extern const Method kCentreline;

}  // namespace probebox::metrology
