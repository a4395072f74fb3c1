#include "judge_cases.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace probebox::judge {

using Eigen::Vector2d;
using Eigen::Vector3d;

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>{low, high}(random);
}

namespace {

double gauss(std::mt19937_64& random, double sigma) {
  return sigma * std::normal_distribution<double>{0.0, 1.0}(random);
}

Vector3d anywhere(std::mt19937_64& random, double size) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

Vector3d blur(std::mt19937_64& random, double sigma) {
  return {gauss(random, sigma), gauss(random, sigma), gauss(random, sigma)};
}

metrology::Line lineOf(const Vector3d& at_zero, const Vector3d& slope, double from_s, double to_s, double sigma,
                       std::mt19937_64& random) {
  std::vector<double> times;
  metrology::Rows3 values{40, 3};
  for (Eigen::Index k = 0; k < 40; ++k) {
    times.push_back(from_s + (to_s - from_s) * static_cast<double>(k) / 39.0);
    values.row(k) = (at_zero + slope * times.back() + blur(random, sigma)).transpose();
  }
  return metrology::fitLine(times, values);
}

// Elbow to the right.
Vector3d jointsAt(const Arm& arm, const Vector3d& tip) {
  const Vector3d reach = tip - arm.base;
  const double square = reach.head<2>().squaredNorm();
  const double elbow = std::acos((square - arm.upper * arm.upper - arm.fore * arm.fore) / (2.0 * arm.upper * arm.fore));
  const double shoulder =
      std::atan2(reach.y(), reach.x()) - std::atan2(arm.fore * std::sin(elbow), arm.upper + arm.fore * std::cos(elbow));
  return {shoulder, elbow, reach.z()};
}

}  // namespace

metrology::Rows3 spherePoints(std::mt19937_64& random, int count) {
  const Vector3d centre = anywhere(random, 200.0);
  const double radius = uniform(random, 5.0, 40.0);
  metrology::Rows3 points{count, 3};
  const std::array<Vector3d, 5> usual{Vector3d::UnitX(), -Vector3d::UnitX(), Vector3d::UnitY(), -Vector3d::UnitY(),
                                      Vector3d::UnitZ()};
  for (Eigen::Index k = 0; k < count; ++k) {
    Vector3d normal = k < 5 ? usual[static_cast<std::size_t>(k)] : anywhere(random, 1.0).normalized();
    normal.z() = std::abs(normal.z());
    points.row(k) = (centre + radius * normal + blur(random, 0.001)).transpose();
  }
  return points;
}

std::vector<metrology::RotationReading> turnedReadings(std::mt19937_64& random, int count, double radius, double arc,
                                                       const metrology::RotationNoise& noise) {
  const Vector2d centre = anywhere(random, 1.0).head<2>();
  const Vector2d arm = Eigen::Rotation2Dd{uniform(random, 1.5, 1.6)} * Vector2d{radius, 0.0};
  std::vector<metrology::RotationReading> readings;
  for (int k = 0; k < count; ++k) {
    const double angle = arc * (k / (count - 1.0) - 0.5);
    const Vector2d at = centre + Eigen::Rotation2Dd{angle + gauss(random, noise.angle)} * arm;
    readings.push_back({at + blur(random, noise.position).head<2>(), angle});
  }
  return readings;
}

PlateReadings plateReadings(std::mt19937_64& random, int balls, double sigma) {
  PlateReadings plate{Eigen::MatrixX3d{balls, 3}, Eigen::MatrixX3d{balls, 3}, {}, {}};
  for (Eigen::Index k = 0; k < balls; ++k) {
    const double angle = 6.283 * static_cast<double>(k) / balls;
    plate.certified.row(k) << 120.0 * std::cos(angle), 120.0 * std::sin(angle), k % 2 == 0 ? 40.0 : 60.0;
  }
  const Eigen::AngleAxisd turn{uniform(random, 0.1, 2.0), anywhere(random, 1.0).normalized()};
  const Vector3d shift = anywhere(random, 30.0);
  const auto placed = [&](Eigen::Index k) { return Vector3d{turn * plate.certified.row(k).transpose() + shift}; };
  for (Eigen::Index k = 0; k < balls; ++k) plate.second.row(k) = (placed(k) + blur(random, sigma)).transpose();
  for (const double angle : {1.0, 2.5, 4.0, 5.5}) {
    const Vector3d delta = blur(random, 0.02);
    const Vector3d tilt = blur(random, 1e-4);
    Eigen::MatrixX3d read{balls, 3};
    for (Eigen::Index k = 0; k < balls; ++k) {
      const Vector3d ideal = Eigen::AngleAxisd{angle, Vector3d::UnitZ()} * placed(k);
      read.row(k) =
          (delta + Eigen::AngleAxisd{tilt.norm(), tilt.normalized()} * ideal + blur(random, sigma)).transpose();
    }
    plate.angles.push_back(angle);
    plate.first.push_back(read);
  }
  return plate;
}

metrology::Dataset rotaryDataset(const PlateReadings& plate) {
  using metrology::Table;
  constexpr std::array<std::string_view, 4> kBall{"ball", "x_mm", "y_mm", "z_mm"};
  Table first = Table::withColumns("first", std::array<std::string_view, 5>{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"});
  Table second = Table::withColumns("second", kBall);
  Table third = Table::withColumns("third", kBall);
  for (Eigen::Index k = 0; k < plate.certified.rows(); ++k) {
    const auto ball = static_cast<double>(k);
    second.append({ball, plate.second(k, 0), plate.second(k, 1), plate.second(k, 2)});
    third.append({ball, plate.certified(k, 0), plate.certified(k, 1), plate.certified(k, 2)});
    for (std::size_t a = 0; a < plate.angles.size(); ++a) {
      first.append({plate.angles[a], ball, plate.first[a](k, 0), plate.first[a](k, 1), plate.first[a](k, 2)});
    }
  }
  return {.method = "rotary-axis-errors",
          .config = {{"axis_point_mm", std::vector<double>{0, 0, 0}}, {"axis_direction", std::vector<double>{0, 0, 1}}},
          .tables = {std::move(first), std::move(second), std::move(third)}};
}

std::vector<TiltedPoint> tiltedReadings(std::mt19937_64& random, const std::vector<double>& tilts) {
  const Vector3d on_axis = anywhere(random, 20.0);
  const Vector3d direction = Vector3d{uniform(random, -.01, .01), uniform(random, -.01, .01), 1.0}.normalized();
  std::vector<TiltedPoint> readings;
  for (std::size_t point = 0; point < 2; ++point) {
    const Vector3d at = Vector3d{100.0, 30.0, 0.0} + anywhere(random, 50.0);
    for (const double tilt : tilts) {
      const Vector3d seen = on_axis + Eigen::AngleAxisd{tilt, direction} * (at - on_axis);
      readings.push_back({seen + blur(random, 0.001), tilt, point});
    }
  }
  return readings;
}

std::vector<metrology::Retract> sphereRetracts(std::mt19937_64& random) {
  const Vector3d centre = anywhere(random, 50.0);
  const double radius = uniform(random, 8.0, 30.0);
  const double delay = uniform(random, 0.001, 0.006);
  const std::array<Vector3d, 5> normals{Vector3d::UnitX(), -Vector3d::UnitX(), Vector3d::UnitY(), -Vector3d::UnitY(),
                                        Vector3d::UnitZ()};
  std::vector<metrology::Retract> retracts;
  for (const double speed : {10.0, 20.0, 40.0}) {
    for (const auto& side : normals) {
      const Vector3d normal = (side + 0.05 * anywhere(random, 1.0)).normalized();
      const Vector3d velocity = speed * normal;
      const double contact_s = 0.4 / speed;  // the tip comes free
      metrology::Retract retract;
      retract.plan.normal = normal;
      retract.plan.retract = normal;
      retract.plan.speed_mm_s = speed;
      const Vector3d surface = centre + radius * normal;
      retract.probe = lineOf(contact_s * velocity, -velocity, 0.0, 0.8 * contact_s, 4e-4, random);
      retract.machine =
          lineOf(surface - (contact_s + delay) * velocity, velocity, delay, contact_s + delay, 5e-4, random);
      retract.machine_apex = surface - 0.4 * normal;
      retract.probe_apex = 0.4 * normal;
      retracts.push_back(retract);
    }
  }
  return retracts;
}

void addJoints(const Arm& arm, std::vector<metrology::Retract>& retracts) {
  for (auto& retract : retracts) {
    const auto& line = retract.machine;
    const double half_s = std::sqrt(3.0 * line.sxx / static_cast<double>(line.n));
    const Vector3d begin = jointsAt(arm, line.at(line.t_mean - half_s));
    const Vector3d middle = jointsAt(arm, line.at(line.t_mean));
    const Vector3d end = jointsAt(arm, line.at(line.t_mean + half_s));
    retract.joints = {.t_mean = line.t_mean, .half_s = half_s, .coefficients = Eigen::Matrix3d{}};
    retract.joints.coefficients << middle, (end - begin) / 2.0, (end + begin) / 2.0 - middle;
  }
}

}  // namespace probebox::judge
