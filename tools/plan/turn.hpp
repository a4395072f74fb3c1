#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "firmware/procedure/plan/step.hpp"
#include "tools/plan/contact.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// Simulates one turn of C until the ball touches the stylus, and back. C turns about Z through the origin. The ball
// sticks to the stylus while it presses.
class Turn {
 public:
  // ball: its centre at C = 0. away: offset of the stylus from its position by the machine, mm.
  Turn(const procedure::Step& step, const Eigen::Vector3d& ball, const Eigen::Vector3d& away, const SetUp& set_up)
      : ball_{ball},
        stylus_{step.touch.travel_mm * vectorOf(step.touch.outward_normal) +
                Eigen::Vector3d{0, ball.head<2>().norm(), ball.z()} + away},
        reach_mm_{(set_up.sphere_diameter_mm + set_up.stylus_ball_diameter_mm) / 2},
        from_rad_{step.touch.rotary_angles_rad[2]},
        to_rad_{step.touch.until_contact->to_rad},
        rate_rad_s_{std::copysign(step.touch.until_contact->speed_rad_s, to_rad_ - from_rad_)},
        contact_rad_{contact()},
        beyond_rad_{std::copysign(step.overtravel_mm / ball.head<2>().norm(), rate_rad_s_)},
        there_s_{(contact_rad_ + beyond_rad_ - from_rad_) / rate_rad_s_},
        dwell_s_{set_up.dwell_s} {}

  double duration() const { return 2 * kRest_s + 2 * there_s_ + dwell_s_; }
  const Eigen::Vector3d& stylus() const { return stylus_; }
  double angle(double t) const {
    const double there_s = std::clamp(t - kRest_s, 0.0, there_s_);
    const double back_s = std::clamp(t - kRest_s - there_s_ - dwell_s_, 0.0, there_s_);
    return from_rad_ + rate_rad_s_ * (there_s - back_s);
  }
  Eigen::Vector3d deflection(double t) const {
    const double pressed_rad = angle(t) - contact_rad_;
    if (pressed_rad * rate_rad_s_ <= 0) return Eigen::Vector3d::Zero();
    return turned(stylus_, pressed_rad) - stylus_;
  }
  // Times at which the stylus is pressed this far.
  double contactTime(double depth_mm) const { return kRest_s + there_s_ - pressing(depth_mm); }
  double releaseTime(double depth_mm) const { return kRest_s + there_s_ + dwell_s_ + pressing(depth_mm); }

 private:
  static constexpr double kRest_s = 0.1;  // before and after

  static Eigen::Vector3d turned(const Eigen::Vector3d& point, double angle_rad) {
    return Eigen::AngleAxisd{angle_rad, Eigen::Vector3d::UnitZ()} * point;
  }
  double contact() const {
    double free = from_rad_, met = to_rad_;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (free + met) / 2;
      ((turned(ball_, middle) - stylus_).norm() > reach_mm_ ? free : met) = middle;
    }
    return (free + met) / 2;
  }
  // Time from that depth to the stop.
  double pressing(double depth_mm) const {
    const Eigen::Vector3d at = turned(ball_, contact_rad_), normal = (stylus_ - at).normalized();
    const double mm_s = std::abs(rate_rad_s_ * Eigen::Vector3d::UnitZ().cross(at).dot(normal));
    return beyond_rad_ / rate_rad_s_ - depth_mm / mm_s;
  }

  Eigen::Vector3d ball_, stylus_;
  double reach_mm_, from_rad_, to_rad_, rate_rad_s_, contact_rad_, beyond_rad_, there_s_, dwell_s_;
};

}  // namespace probebox::plan
