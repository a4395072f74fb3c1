#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch_design.hpp"
#include "firmware/metrology/touch/touch_selection.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Common part of the touch methods for the system delay (CN101622513, docs/metrology.md A.3 to A.6): finds the touches
// that agree by their retracts (A5)-(A7), (A12), and the delay from their whole records (A7b). sd: from the pooled
// residuals of the samples, with `dof` degrees of freedom, widened when the touches scatter more. A bad touch is
// dropped by name, with a warning, as long as the others are redundant.
class TouchDelay {
 public:
  // Reads the config keys feature, lost_motion_mm, previous_tau_s (previous_tau_axis_s for a delay per axis), A_rad and
  // B_rad, and the tables. Refuses: bad-config, and what spindleOfProbe, refuseSpeeds, readTouches and agreeOn refuse.
  static Outcome<TouchDelay, Refusal> measure(const Dataset& dataset, TouchQuestion question);

  const AgreedTouches& touches() const { return touches_; }
  double widening() const { return touches_.widening(); }

  // Makes a result without estimates: quality of the fit, warnings, dropped touches.
  Result report() const;
  // Adds delay and centre, and gain matrix, size and what addSizeCheck adds. Refuses what that does.
  Outcome<Result, Refusal> onSphere() const;
  // The delay alone, and what addSizeCheck adds. Refuses what that does.
  Outcome<Result, Refusal> delayAlone() const;
  // Adds what the touches say of a stated size, and the lost motion, where they tell them. Refuses: bad-config.
  std::optional<Refusal> addSizeCheck(Result& result) const;

  // tau_s or tau_axis_s: the delay measured in addition to the previous one.
  Estimate delay() const;
  // If the touches span three dimensions.
  std::optional<Estimate> centre() const;
  // Gain matrix of the probe with the spindle at 0, rotated back from the stated angle.
  std::optional<Estimate> gainMatrix() const;
  // Of the axes; nothing at one speed.
  std::optional<Estimate> lostMotion() const;
  // If it was not known, or the whole records tell it.
  Estimate size() const;
  // What the touches measure beyond a stated size; nothing where the delay came from that size.
  std::optional<Estimate> staticError(double stated_mm) const;
  // Warning of a size that is not as the case states it, with the sd that the case states.
  Outcome<std::optional<std::string>, Refusal> whyNotAsStated(const Estimate& error) const;
  // Covariance of some of these, in their order.
  Covariance covarianceOf(std::span<const Estimate> estimates) const;

 private:
  TouchDelay(const Dataset& dataset, const TouchQuestion& question, AgreedTouches touches, std::vector<TouchPlan> plans,
             Eigen::VectorXd previous, std::optional<double> spindle_rad)
      : dataset_{&dataset},
        question_{question},
        touches_{std::move(touches)},
        design_{touchDesign(touches_, question)},
        plans_{std::move(plans)},
        previous_{std::move(previous)},
        spindle_rad_{spindle_rad} {}

  double bentBy() const;
  // Estimate::per_shift of some rows of TouchFit::per_shift.
  std::vector<double> perShift(Eigen::Index first, Eigen::Index rows) const;
  void addWarnings(Result& result) const;
  void addResiduals(Result& result) const;
  void addTouched(Result& result) const;

  const Dataset* dataset_;
  TouchQuestion question_;
  AgreedTouches touches_;
  TouchDesign design_;
  std::vector<TouchPlan> plans_;       // of all touches, dropped ones too
  Eigen::VectorXd previous_;           // s
  std::optional<double> spindle_rad_;  // while the probe touched; nothing where the case does not state it
};

}  // namespace probebox::metrology
