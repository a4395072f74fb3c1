#pragma once
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/scan_path.hpp"
#include "tools/plan/contact.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// Simulates a scan over time around a ball whose middle is the origin, with an exact stop after each way.
class ScanMotion {
 public:
  ScanMotion(const procedure::Step& step, const SetUp& set_up)
      : reach_mm_{(set_up.sphere_diameter_mm + set_up.stylus_ball_diameter_mm) / 2} {
    const ScanPath& scan = step.touch.scan;
    double angle_rad = scan.start_rad;
    Eigen::Vector3d here = at(angle_rad, scan.depths_mm[0]);
    for (std::size_t i = 0; i < waysOf(scan); ++i) {
      const ScanWay way = wayOf(scan, i);
      const double from_rad = angle_rad;
      angle_rad += way.turn_rad;
      const Eigen::Vector3d to = at(angle_rad, way.to_depth_mm);
      const double length_mm = way.is_arc ? here.norm() * std::abs(way.turn_rad) : (to - here).norm();
      legs_.push_back({way, from_rad, here, to, end_s_,
                       Drive{length_mm, step.touch.retract_speed_mm_s, set_up.acceleration_mm_s2}, length_mm});
      end_s_ += legs_.back().drive.duration();
      here = to;
    }
  }

  double duration() const { return end_s_ + kLead_s; }
  Eigen::Vector3d body(double t) const {
    const Leg* leg = &legs_.front();
    for (const Leg& each : legs_) {
      if (each.begin_s <= t) leg = &each;
    }
    const double share = leg->drive.at(t - leg->begin_s) / leg->length_mm;
    if (!leg->way.is_arc) return leg->from + share * (leg->to - leg->from);
    return at(leg->from_rad + share * leg->way.turn_rad, leg->way.to_depth_mm);
  }
  // Deflection of a probe without friction whose gain matrix is the identity.
  Eigen::Vector3d deflection(double t) const {
    const Eigen::Vector3d here = body(t);
    return (reach_mm_ - here.norm()) * here.normalized();
  }

 private:
  struct Leg {
    ScanWay way;
    double from_rad;
    Eigen::Vector3d from, to;
    double begin_s;
    Drive drive;
    double length_mm;
  };

  Eigen::Vector3d at(double angle_rad, double depth_mm) const {
    return (reach_mm_ - depth_mm) * Eigen::Vector3d{std::cos(angle_rad), std::sin(angle_rad), 0};
  }

  double reach_mm_;
  double end_s_{kLead_s};
  std::vector<Leg> legs_;
};

}  // namespace probebox::plan
