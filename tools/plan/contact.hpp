#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/procedure/plan/step.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

inline constexpr double kLead_s = 0.02;  // rest before and after a touch

inline Eigen::Vector3d vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// Moves over a distance from rest to rest with a trapezoidal speed profile. Units: mm, mm/s, mm/s2.
class Drive {
 public:
  Drive(double distance, double speed, double acceleration)
      : distance_{distance},
        speed_{std::min(speed, std::sqrt(distance * acceleration))},
        acceleration_{acceleration},
        ramp_{speed_ / acceleration},
        cruise_{distance / speed_ - ramp_} {}
  double duration() const { return 2 * ramp_ + cruise_; }
  // Time at which it has covered `distance`, s after its start.
  double timeOf(double distance) const {
    double before = 0, after = duration();
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (before + after) / 2;
      (this->at(middle) < distance ? before : after) = middle;
    }
    return (before + after) / 2;
  }
  double at(double t) const {
    if (t <= 0) return 0;
    if (t < ramp_) return 0.5 * acceleration_ * t * t;
    if (t < ramp_ + cruise_) return speed_ * (t - 0.5 * ramp_);
    const double left = std::max(0.0, duration() - t);
    return distance_ - 0.5 * acceleration_ * left * left;
  }

 private:
  double distance_, speed_, acceleration_, ramp_, cruise_;
};

// Simulates one touch over time along a straight line through the touched point, on which the tip does not slip.
class Contact {
 public:
  Contact(const procedure::Step& step, const Eigen::Vector3d& surface, const SetUp& set_up)
      : clearance_mm_{step.clearance_mm},
        overtravel_mm_{step.overtravel_mm},
        retract_{vectorOf(step.touch.retract_direction)},
        surface_{surface},
        dwell_s_{step.kind == procedure::Kind::in_out ? 0 : set_up.dwell_s},
        in_{step.clearance_mm + step.overtravel_mm, step.touch.retract_speed_mm_s, set_up.acceleration_mm_s2},
        out_{step.clearance_mm + step.overtravel_mm + step.run_out_mm, step.touch.retract_speed_mm_s,
             set_up.acceleration_mm_s2} {}

  double duration() const { return 2 * kLead_s + in_.duration() + dwell_s_ + out_.duration(); }
  Eigen::Vector3d body(double t) const { return surface_ + outside(t) * retract_; }
  // Times at which the tip is at `depth_mm` on the way in and out, s after the beginning: a switch trips and releases.
  double contactTime(double depth_mm) const { return kLead_s + in_.timeOf(clearance_mm_ + depth_mm); }
  double releaseTime(double depth_mm) const {
    return kLead_s + in_.duration() + dwell_s_ + out_.timeOf(overtravel_mm_ - depth_mm);
  }
  // Deflection of a probe whose gain matrix is the identity, mm.
  Eigen::Vector3d deflection(double t) const { return std::max(0.0, -outside(t)) * retract_; }

 private:
  double outside(double t) const {
    const double since = t - kLead_s;
    return clearance_mm_ - in_.at(since) + out_.at(since - in_.duration() - dwell_s_);
  }

  double clearance_mm_, overtravel_mm_;
  Eigen::Vector3d retract_, surface_;
  double dwell_s_;
  Drive in_, out_;
};

}  // namespace probebox::plan
