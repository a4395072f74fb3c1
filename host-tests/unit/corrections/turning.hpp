#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <random>
#include <vector>

#include "joint.hpp"
#include "protocol/units/angle.hpp"

// The same joint on a machine with a head that swivels by B, and a table that C turns, or that B carries and C turns.
// What is served is compared with real points that are turned about real axes.
namespace probebox::corrections {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

inline constexpr auto kSwivel = static_cast<std::size_t>(SourceKind::swivel);
inline constexpr auto kRotary = static_cast<std::size_t>(SourceKind::rotary);

inline CorrectionsConfig turning(std::uint16_t mask) {
  auto config = MachineOnADesk::usual();
  config.screws = {};
  config.mask = mask;
  // B is told by the controller, C has an encoder.
  config.angles[1] = {.described = true, .from = AngleFrom::controller, .reference = {}, .stale = milliseconds{1000}};
  config.angles[2] = {.described = true,
                      .from = AngleFrom::encoder,
                      .reference = {.by = ReferenceBy::homing, .mm_per_count = MachineOnADesk::kDegPerCount},
                      .stale = milliseconds{250}};
  config.tools.count = 2;
  config.tools.lengths[0] = {.number = 4, .length_mm = 120};
  config.tools.lengths[1] = {.number = 5, .length_mm = 170};
  config.swivel = {.fitted = true, .axis = RotaryAxis::b, .by_angle = false, .hold = std::chrono::seconds{2}};
  config.rotary.count = 1;
  config.rotary.chain = {RotaryAxis::c};
  config.rotary.hold = std::chrono::seconds{2};
  return config;
}

class Turning : public Joint {
 protected:
  explicit Turning(const CorrectionsConfig& config) : Joint{config} { machine.angle_deg[2] = 0; }

  void tellB(double degrees) {
    machine.corrections.push(PoseTold{.axes = 2,
                                      .angles_rad = {0, degrees * kDegree, 0},
                                      .has_tool = false,
                                      .tool = 0,
                                      .tool_length_mm = 0,
                                      .at = machine.now});
  }
  void tellTool(std::uint32_t number, double length_mm = 0) {
    machine.corrections.push(PoseTold{
        .axes = 0, .angles_rad = {}, .has_tool = true, .tool = number, .tool_length_mm = length_mm, .at = machine.now});
  }
  void homeC() {
    machine.corrections.push(PoseTold{.axes = 4,
                                      .angles_rad = {0, 0, *machine.angle_deg[2] * kDegree},
                                      .has_tool = false,
                                      .tool = 0,
                                      .tool_length_mm = 0,
                                      .at = machine.now});
  }
  // A controller that says again and again how B stands, as it must.
  void runTelling(double degrees, double seconds) {
    for (double t = 0; t < seconds; t += 0.5) tellB(degrees), run(0.5);
  }
  // Turns C there, at 50 degrees a second.
  void turnC(double to_deg) {
    for (double& angle = *machine.angle_deg[2]; std::abs(to_deg - angle) > 0.5; run(0.01))
      angle += to_deg > angle ? 0.5 : -0.5;
    machine.angle_deg[2] = to_deg;
    run(0.1);
  }
  void expectJointAt(const Vector3d& wanted_mm) const {
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      EXPECT_NEAR(joint_mm[axis], wanted_mm[static_cast<Eigen::Index>(axis)], 3e-6) << "XYZ"[axis];
  }
  Health health(std::size_t kind) const { return machine.snapshot().health[kind]; }
};

// A rigid head (B20): its gauge line is off by q and its tool points a little aside, both in the head.
struct Head {
  Vector3d gauge{0.010, 0, 0.025};
  Vector3d aside{2e-4, 0, -1e-4};

  Vector3d error(double swivel_deg, double length_mm) const {
    const Vector3d off = gauge + length_mm * aside;
    return off - AngleAxisd{swivel_deg * kDegree, Vector3d::UnitY()} * off;
  }
  // Column by column the limits of error(): B = 90 is s + r, B = 180 is 2 r.
  SwivelActivated result(std::uint64_t id) const {
    SwivelActivated activated{.result_id = id, .axis = RotaryAxis::b, .terms = {}, .rows = 0, .at = {}};
    for (const double length : {0.0, 1.0}) {
      const std::size_t k = length > 0 ? 1 : 0;
      const Vector3d rest = (error(180, length) - (k == 1 ? error(180, 0) : Vector3d::Zero())) / 2;
      const Vector3d sine = error(90, length) - (k == 1 ? error(90, 0) : Vector3d::Zero()) - rest;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        activated.terms[4 * axis + k] = sine[static_cast<Eigen::Index>(axis)];
        activated.terms[4 * axis + 2 + k] = rest[static_cast<Eigen::Index>(axis)];
      }
    }
    return activated;
  }
};

// A rotary axis with errors at 12 angles, and what they do to a point by exact rotations.
struct RealAxis {
  RotaryAxis axis;
  Vector3d point;
  Vector3d direction;
  std::vector<metrology::SixErrors> errors;

  static RealAxis random(RotaryAxis axis, const Vector3d& point, const Vector3d& direction, unsigned seed) {
    std::mt19937 random{seed};
    std::uniform_real_distribution<double> spread{-1, 1};
    RealAxis real{axis, point, direction, {}};
    for (int k = 0; k < 12; ++k) {
      metrology::SixErrors six;
      for (Eigen::Index e = 0; e < 6; ++e) six[e] = spread(random) * (e < 3 ? 0.01 : 5e-5);
      real.errors.push_back(six);
    }
    return real;
  }
  Vector3d nominal(const Vector3d& p, double degrees) const {
    return point + AngleAxisd{degrees * kDegree, direction} * (p - point);
  }
  // At one of the 12 angles.
  Vector3d real(const Vector3d& p, double degrees) const {
    const auto& six = errors[static_cast<std::size_t>(std::lround(degrees / 30) + 12) % 12];
    const Vector3d tilt = six.tail<3>();
    return point + six.head<3>() + AngleAxisd{tilt.norm(), tilt.normalized()} * (nominal(p, degrees) - point);
  }
  // All rows that the core hears, but the last ones left out.
  std::vector<Event> result(std::uint64_t id, std::size_t without = 0, std::size_t angles = 12) const {
    RotaryActivated head{.result_id = id,
                         .axis = axis,
                         .point_mm = {point.x(), point.y(), point.z()},
                         .direction = {direction.x(), direction.y(), direction.z()},
                         .sd = {1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6},
                         .rows = static_cast<std::uint8_t>(angles),
                         .at = {}};
    std::vector<Event> events{head};
    for (std::size_t k = 0; k + without < angles; ++k) {
      ErrorsAtAngle row{.of = ErrorsOf::rotary,
                        .axis = axis,
                        .result_id = id,
                        .angle_rad = 30 * kDegree * static_cast<double>(k),
                        .errors = {},
                        .at = {}};
      std::copy(errors[k].begin(), errors[k].end(), row.errors.begin());
      events.emplace_back(row);
    }
    return events;
  }
};

}  // namespace probebox::corrections
