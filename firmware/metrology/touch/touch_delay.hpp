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

// What the touch methods for the system delay have in common (CN101622513, docs/metrology.md A.3 to A.6): the touches
// of a dataset, reduced to retract lines (A5)-(A7) and fitted together (A12). sd from the pooled residuals of the
// samples, whose degrees of freedom are `dof`; widened when the touches agree worse than that. A touch that is bad on
// its own is dropped by name, with a warning, as long as the others check each other.
class TouchDelay {
 public:
  // Reads the config keys feature, previous_tau_s (previous_tau_axis_s for a delay of each axis) and the tables.
  // Refuses: bad-config, and what refuseSpeeds, readTouches and agreeOn refuse.
  static Outcome<TouchDelay, Refusal> measure(const Dataset& dataset, const TouchQuestion& question);

  const AgreedTouches& touches() const { return touches_; }
  double widening() const { return touches_.widening(); }

  // A result with everything but the estimates: quality of the fit, warnings, what was dropped. keys: those of the
  // configuration that the method reads itself.
  Result report(std::span<const std::string_view> keys) const;
  // The report with delay and centre; also gain matrix, and the size when it was not known.
  Result onSphere(std::span<const std::string_view> keys) const;

  // tau_s or tau_axis_s: the delay found here on top of the one that the stamps have been corrected by.
  Estimate delay() const;
  // Where the touches span space.
  std::optional<Estimate> centre() const;
  std::optional<Estimate> gainMatrix() const;
  // Where it was not known.
  Estimate size() const;
  // Of some of these, in their order.
  Covariance covarianceOf(std::span<const Estimate> estimates) const;

 private:
  TouchDelay(const Dataset& dataset, const TouchQuestion& question, AgreedTouches touches, Eigen::VectorXd previous)
      : dataset_{&dataset},
        question_{question},
        touches_{std::move(touches)},
        design_{touchDesign(touches_.retracts, touches_.fit, question)},
        previous_{std::move(previous)} {}

  void addWarnings(Result& result) const;
  void addResiduals(Result& result) const;

  const Dataset* dataset_;
  TouchQuestion question_;
  AgreedTouches touches_;
  TouchDesign design_;
  Eigen::VectorXd previous_;  // s
};

}  // namespace probebox::metrology
