#pragma once
#include <cstddef>
#include <numbers>

// Limits that several rooms share, each with its source: a derivation, an equation of docs/metrology.md, or a choice.
namespace probebox {

// Smallest span of the angles that locate an axis. By (B7) two tilts 20 degrees apart give the pivot four times the sd
// of two that are 90 degrees apart.
inline constexpr double kLeastTiltSpan_deg = 20;
// Smallest half arc that locates a centre. The centre follows from 1 - cos of this angle, 0.034, which amplifies the
// noise of a reading 29 times.
inline constexpr double kLeastHalfArc_rad = 15.0 * std::numbers::pi / 180.0;
// Smallest span of the tools or heights that determine a direction. Its sd is sqrt(2) sigma over the span: 0.14 mrad
// per um at 10 mm.
inline constexpr double kLeastLengthSpan_mm = 10;
// Sides count as opposite if their normals have at most this cosine, within 20 degrees of opposite (chosen): a touch
// then misses the diameter by 6 % of the offset.
inline constexpr double kOppositeCosine = -0.94;
// Touches are of one side of what is touched if their normals have at least this cosine, within 8 degrees of each other
// (chosen): form differs little over that.
inline constexpr double kSameSideCosine = 0.99;
// Allowed deviation from 1 of the length of a unit vector: people write three digits.
inline constexpr double kUnitLength = 1e-3;

// Longest tool, and farthest turn of a rotary axis either way, that a control or a description may state (chosen):
// beyond, a value was misread.
inline constexpr double kMostToolLength_mm = 2000;
inline constexpr double kMostTurn_deg = 3600;

// Maximum number of loops of centreline-by-steps. Chosen: a run that has not closed by then does not converge.
inline constexpr std::size_t kMostRimLoops = 5;
// Reach of the probe to either side on the rim of a large part (chosen), 40 degrees each.
inline constexpr double kUsualRimArc_rad = 1.3962634015954636;
// Allowed difference of the reported from the commanded angle of a rotary axis; also the limit within which a head or
// table counts as level (chosen).
inline constexpr double kPoseTolerance_rad = 2e-3;
inline constexpr double kPoseTolerance_deg = kPoseTolerance_rad * 180 / std::numbers::pi;
// Reported angles of one stop: each is within kPoseTolerance_rad of the wanted one, so two are within twice that.
inline constexpr double kSameStop_rad = 2 * kPoseTolerance_rad;
inline constexpr double kSameStop_deg = 2 * kPoseTolerance_deg;
// Reported against wanted angle, where the report is the wanted angle to the digits of a control: half of 0.001
// degrees, the digit of the marker's registers, is 8.7 urad.
inline constexpr double kEchoedAngle_rad = 1e-5;

// Angles that are equal as written. Chosen: above the seven decimals of a case file, and below what any control
// reports. Angles that a control has measured differ by more at one stop: compare them by kSameStop_rad.
inline constexpr double kSameAngle_deg = 1e-6;
inline constexpr double kSameAngle_rad = 1e-6;
// Heights at which one ball was read, as measured. Chosen: a ball 250 mm from an axis that leans by 1 mrad runs up and
// down by 0.25 mm; balls of their own are 10 mm apart and more.
inline constexpr double kSameHeight_mm = 0.5;
// The same for a table by angle, whose angles are compared in the digits they were stored with.
inline constexpr double kSameTableAngle_rad = 1e-8;

// Temperatures that a machine and what it measures may have, degrees C. Chosen: beyond any workshop; kelvin and degrees
// Fahrenheit of a workshop are mostly outside.
inline constexpr double kColdest_c = -30;
inline constexpr double kWarmest_c = 70;

// Samples and touches beyond this many robust deviations are outliers: false for one Gaussian value in 150 000.
inline constexpr double kOutlierDeviations = 4.5;
// Residuals of balls beyond this many sigma refuse a case: 4 would refuse one good case in some thousands.
inline constexpr double kWorstResidual_sigma = 5;
// A touch refuses the case if it is an outlier and misses the feature by more than this share of the overtravel
// (chosen).
inline constexpr double kGrossShare = 0.01;
// Share of the samples of a waveform or contour that may be dropped (chosen).
inline constexpr double kMostDroppedShare = 0.10;

// Smallest significant difference in a stream, in its own unit: case files have seven decimals.
inline constexpr double kCaseDigits = 1e-7;
// Smallest significant residual of balls, mm: the rounding of their angles and positions after a turn.
inline constexpr double kBallResidualFloor_mm = 1e-5;

}  // namespace probebox
