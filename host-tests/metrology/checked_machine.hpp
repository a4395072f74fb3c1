#pragma once
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <random>
#include <string_view>
#include <utility>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A machine that a periodic check reads, in three dimensions: swivel, spindle and C each turn what hangs on them.
namespace probebox::metrology {

inline constexpr double kRe = 12.5;
inline constexpr double kExpectedZ = 80.0;

struct CheckedMachine {
  Eigen::Vector3d centreline{0.02, -0.006, 0.0};  // C axis, parallel to Z
  Eigen::Vector3d ball{1.9, 1.4, kExpectedZ};     // on the chuck at C = 0, from the C axis
  Eigen::Vector3d stylus{0.025, -0.026, 0.0};     // from the spindle axis, at A = 0
  double x_offset_error{0.0095};                  // of the tool table at B = 90
  double z_offset_error{0.0125};                  // and at B = 0
  double sigma_c_rad{0};                          // of every stop of C

  // What the control shows when the stylus is centred on the ball: its tool table knows all but the stylus' run-out.
  Eigen::Vector3d centred(double b, double c, double a) const {
    const Eigen::AngleAxisd chuck{c * kDegree, Eigen::Vector3d::UnitZ()};
    const Eigen::AngleAxisd swivel{b * kDegree, Eigen::Vector3d::UnitY()};
    const Eigen::AngleAxisd spindle{a * kDegree, Eigen::Vector3d::UnitZ()};
    return centreline + chuck * ball - swivel * (spindle * stylus);
  }
};

inline Dataset checkOf(const CheckedMachine& machine, double sigma, std::mt19937_64& random, bool diameters = false) {
  Dataset dataset{.method = "periodic-check",
                  .config = {{"effective_ball_radius_mm", kRe},
                             {"expected_ball_centre_z_mm", kExpectedZ},
                             {"x_is_radius", !diameters},
                             {"sigma_mm", sigma}},
                  .tables = {}};
  stateExactMachine(dataset);
  Table centres =
      Table::withColumns("centres", std::array<std::string_view, 6>{"B_deg", "C_deg", "A_deg", "x_mm", "y_mm", "z_mm"});
  std::map<std::array<double, 3>, double> off;  // of C in every pose, degrees
  for (const double b : {90.0, 0.0, 45.0}) {
    for (const double c : {0.0, 180.0}) {
      for (const double a : {0.0, 180.0}) {
        if (machine.sigma_c_rad > 0) off[{b, c, a}] = gauss(random, machine.sigma_c_rad) / kDegree;
        const Eigen::Vector3d at = machine.centred(b, c + off[{b, c, a}], a);
        centres.append(
            {b, c, a, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
      }
    }
  }
  Table x = Table::withColumns("x_touch", std::array<std::string_view, 4>{"B_deg", "C_deg", "A_deg", "x_mm"});
  for (const double c : {0.0, 180.0}) {
    // The tip lies along X here; from +X it touches the ball, Re short of it. X counts from the C axis.
    const double turned = c + off[{90.0, c, 180.0 - c}];
    const Eigen::Vector3d chuck = Eigen::AngleAxisd{turned * kDegree, Eigen::Vector3d::UnitZ()} * machine.ball;
    const double radius = chuck.x() + kRe + machine.x_offset_error;
    x.append({90.0, c, 180.0 - c, (diameters ? 2.0 : 1.0) * radius + gauss(random, sigma)});
  }
  Table z = Table::withColumns("z_touch", std::array<std::string_view, 4>{"B_deg", "C_deg", "A_deg", "z_mm"});
  z.append({0.0, 180.0, 0.0, machine.ball.z() + kRe + machine.z_offset_error + gauss(random, sigma)});
  dataset.tables = {std::move(centres), std::move(x), std::move(z)};
  return dataset;
}

}  // namespace probebox::metrology
