#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/kinematics/joint_path.hpp"
#include "firmware/metrology/touch/quantisation.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A touch reduced to two lines of its retract, each over the constant-speed window of its own stream: the machine
// stream lags by speed times delay, so a common window would include a ramp (CN101622513, docs/metrology.md A.3).
struct Retract {
  TouchPlan plan;
  Line machine;  // mm
  Line probe;    // raw channels
  // Rests at the apex in each stream, for the check of full deflection.
  Eigen::Vector3d machine_apex;
  Eigen::Vector3d probe_apex;
  std::vector<std::string> spikes;     // samples in the windows that the lines do not use
  QuantisationError rounding{};        // of the machine's line
  QuantisationError probe_rounding{};  // of the probe's
  // Sums of e_k e_{k+1}' over the residuals of either line: see sampleCorrelation.
  Eigen::Matrix3d machine_neighbours = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d probe_neighbours = Eigen::Matrix3d::Zero();
  JointPath joints{};  // within the machine's window, where its axes are not Cartesian
};

// Time at which the probe's line has zero deflection, s (A5), (A6): along the principal direction of the retract.
double separationTime(const Line& probe);

// Machine position at zero deflection (A7), mm, displaced by the lag: M = P - tau v (A2).
Eigen::Vector3d separationPoint(const Line& machine, const Line& probe);

// Samples and travel that the line fits need from one touch, so that a plan can be checked before it is run.
struct RetractNeeds {
  static constexpr std::size_t kPositions = 5;  // tell a ramp from noise
  // Travel of the machine, in overtravels from its apex: the latest at which it may reach its speed, and the end of its
  // window.
  static constexpr double kFrom = 0.7, kUntil = 3.0;
  static constexpr std::size_t kDeflections = 4;  // three, and one for the ends of the window
  // Shares of the deflection at rest: where the machine may still gather speed, and where the stylus seats.
  static constexpr double kHighest = 0.60, kLowest = 0.04;
};

// Finds the windows and fits the lines.
// Refuses, about this touch alone: no-contact, truncated (a record that ends before separation), too-few-samples (under
// three in a window), gap, speed-not-constant (within 2 %), speed-differs (from the nominal by more than 20 %),
// wrong-direction, stamps-jump, probe-not-at-zero, deflection-unsteady (at rest, in direction), deflection-not-falling,
// residual-too-large (slip or bounce: rms above 3 sigma of the record, or the window of the source is not on one line).
// A single sample that is off is omitted and named. jitter: of the stamps, estimated from all touches of the set.
Outcome<Retract, Refusal> fitRetract(const Touch& touch, const StampJitter& jitter);

}  // namespace probebox::metrology
