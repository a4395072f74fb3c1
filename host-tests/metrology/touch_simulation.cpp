#include "host-tests/metrology/touch_simulation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "firmware/metrology/fit/decompositions.hpp"
#include "host-tests/metrology/exact_machine.hpp"

namespace probebox::metrology::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// From rest over a distance, through a trapezoid of speed; `settle` false keeps the speed at the end.
class Drive {
 public:
  Drive(double distance, double speed, double acceleration, bool settle)
      : distance_{distance}, speed_{speed}, acceleration_{acceleration}, settle_{settle} {
    ramp_ = speed / acceleration;
    const double on_ramps = 0.5 * speed * ramp_ * (settle ? 2.0 : 1.0);
    cruise_ = (distance - on_ramps) / speed;
  }
  double duration() const { return ramp_ + cruise_ + (settle_ ? ramp_ : 0.0); }
  double at(double t) const {
    if (t <= 0.0) return 0.0;
    if (t < ramp_) return 0.5 * acceleration_ * t * t;
    if (t < ramp_ + cruise_ || !settle_) return 0.5 * speed_ * ramp_ + speed_ * (t - ramp_);
    const double left = std::max(0.0, duration() - t);
    return distance_ - 0.5 * acceleration_ * left * left;
  }

 private:
  double distance_;
  double speed_;
  double acceleration_;
  bool settle_;
  double ramp_{};
  double cruise_{};
};

// One touch, in physical time: driven along a straight line through the touched point, which sticks to the tip.
class Contact {
 public:
  Contact(const Scene& scene, const Vector3d& normal, const Vector3d& retract, double speed)
      : scene_{scene},
        normal_{normal},
        retract_{retract},
        surface_{scene.centre_mm + (scene.radius_mm + scene.lobing_mm * lobes(normal)) * normal},
        in_{scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, true},
        out_{2.0 * scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, false},
        inverse_gain_{inverse(scene.gain)} {
    const double reach = 0.5 * speed * speed / scene.acceleration_mm_s2;
    touched_ = speed / scene.acceleration_mm_s2 + (scene.clearance_mm - reach) / speed;
  }

  static constexpr double kLead = 0.003;  // s at rest before the drive
  double duration() const { return kLead + in_.duration() + scene_.dwell_s + out_.duration(); }

  // Distance outside the surface along the way; negative when the tip is pressed on.
  double outside(double t) const {
    const double since = t - kLead;
    const double back = out_.at(since - in_.duration() - scene_.dwell_s);
    return scene_.clearance_mm - in_.at(since) + back;
  }
  Vector3d body(double t) const { return surface_ + outside(t) * retract_; }
  // The tip sticks where the body was when it touched.
  Vector3d deflection(double t) const {
    const double touching = lostMotion(0.0, false).dot(normal_) / retract_.dot(normal_);
    const double since = t - kLead;
    const bool back = since > in_.duration();
    const Vector3d pressed =
        (-touching - outside(t)) * retract_ + lostMotion(0.0, false) - lostMotion(outside(t) - apex(), back);
    const double depth = pressed.dot(normal_) / retract_.dot(normal_);
    if (depth <= 0.0) return Vector3d::Zero();
    const double lag =
        0.5 * scene_.hysteresis_mm * std::min(1.0, depth / kTakenUp_mm) * sideOf(outside(t) - apex(), back);
    const double bent = 1.0 + scene_.gain_bend * depth / scene_.overtravel_mm;
    return inverse_gain_ * (bent * (pressed + retract_ * (ringing(since - touched_) + lag)));
  }

 private:
  static constexpr double kTakenUp_mm = 0.02;

  static double lobes(const Vector3d& normal) {
    return std::cos(3.0 * std::atan2(normal.y(), normal.x())) * normal.head<2>().norm();
  }
  double apex() const { return -scene_.overtravel_mm; }
  // -1 on the way in, 1 on the way back once it has gone far enough.
  double sideOf(double gone, bool back) const { return back ? std::min(1.0, 2.0 * gone / kTakenUp_mm - 1.0) : -1.0; }
  // Of the body from where its encoders say.
  Vector3d lostMotion(double gone, bool back) const {
    const double half = 0.5 * scene_.lost_motion_mm;
    Vector3d behind = Vector3d::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double u = retract_[axis];
      if (std::abs(u) < 1e-9) continue;
      const double side = back ? std::clamp(half - gone * std::abs(u), -half, half) : half;
      behind[axis] = u > 0.0 ? side : -side;
    }
    return behind;
  }
  double ringing(double since) const {
    const double swing = std::sin(2.0 * std::numbers::pi * 160.0 * since);
    return scene_.bounce_mm * std::exp(-since / 0.009) * (scene_.bounces_off ? std::abs(swing) : swing);
  }

  const Scene& scene_;
  Vector3d normal_;
  Vector3d retract_;
  Vector3d surface_;
  Drive in_;
  Drive out_;
  Matrix3d inverse_gain_;
  double touched_{};
};

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>{low, high}(random);
}

double gaussian(Random& random, double sigma) {
  return sigma > 0.0 ? std::normal_distribution<double>{0.0, sigma}(random) : 0.0;
}

struct Sampling {
  double rate_hz{};
  Vector3d sigma;
  double resolution{};
  Vector3d delay_s;  // of each component
};

void sample(Table& table, double touch, double duration, const Scene& scene, const Sampling& sampling,
            const std::function<Vector3d(double)>& truth, Random& random) {
  const double phase = uniform(random, 0.0, 1.0);
  Vector3d noise = Vector3d::Zero();
  for (double count = phase; count / sampling.rate_hz < duration; ++count) {
    const double t = count / sampling.rate_hz;
    Vector3d value;
    for (Eigen::Index k = 0; k < 3; ++k) value[k] = truth(t - sampling.delay_s[k])[k];
    for (Eigen::Index k = 0; k < 3; ++k) {
      double& component = value[k];
      const double fresh = count == phase ? 1.0 : std::sqrt(1.0 - scene.correlation * scene.correlation);
      noise[k] = scene.correlation * noise[k] + fresh * gaussian(random, sampling.sigma[k]);
      component += noise[k];
      if (sampling.resolution > 0.0) component = std::round(component / sampling.resolution) * sampling.resolution;
    }
    const double stamp = t + gaussian(random, scene.stamp_jitter_s);
    if (uniform(random, 0.0, 1.0) < scene.lost_share) continue;
    table.append({touch, stamp, value.x(), value.y(), value.z()});
  }
}

// (A8): variance of the surface point, mm^2, at one speed.
double pointVariance(const Scene& scene, double speed) {
  const double jitter = std::pow(scene.stamp_jitter_s * speed, 2);
  const double samples = 0.5 * scene.overtravel_mm / speed * scene.probe_rate_hz;
  const double probe = (std::pow(scene.probe_sigma_mm, 2) + jitter) / samples * (1.0 + 3.0 * std::pow(0.7 / 0.5, 2));
  const double window = 0.75 * scene.overtravel_mm + scene.clearance_mm;
  const double machine_samples = window / speed * scene.machine_rate_hz;
  const double q = (0.75 * scene.overtravel_mm - window / 2.0) / window;
  return probe + (std::pow(scene.machine_sigma_mm, 2) + jitter) / machine_samples * (1.0 + 12.0 * q * q);
}

// A direction at `angle` from a unit vector, turned about it at random.
Vector3d tilted(const Vector3d& axis, double angle, Random& random) {
  const Vector3d across = axis.unitOrthogonal();
  const double turn = uniform(random, 0.0, 2.0 * std::numbers::pi);
  const Vector3d sideways = std::cos(turn) * across + std::sin(turn) * axis.cross(across);
  return std::cos(angle) * axis + std::sin(angle) * sideways;
}

constexpr double kStylusBall = 6.0;  // mm

void configure(Dataset& dataset, const Scene& scene) {
  if (scene.method == "delay-plates") {
    dataset.config["gap_mm"] = 2.0 * std::abs(scene.radius_mm) + (scene.radius_mm < 0.0 ? kStylusBall : -kStylusBall);
    dataset.config["stylus_ball_diameter_mm"] = kStylusBall;
  } else if (scene.method != "delay-multi-speed") {
    dataset.config["effective_diameter_mm"] = 2.0 * std::abs(scene.radius_mm);
  }
}

}  // namespace

Scene knownSphere() {
  Scene scene;
  scene.method = "delay-known-sphere";
  scene.speeds_mm_s = {25.0};
  return scene;
}

Scene plates() {
  Scene scene = knownSphere();
  scene.method = "delay-plates";
  scene.radius_mm = -21.0;
  scene.normals = {{-1, 0, 0}, {1, 0, 0}};
  return scene;
}

Scene perAxis() {
  Scene scene = knownSphere();
  scene.method = "delay-per-axis";
  scene.normals.emplace_back(0, 0, -1);
  scene.more_delay_s = {0.0, 0.001, -0.001};
  return scene;
}

Scene nonNormal() {
  Scene scene = knownSphere();
  scene.method = "delay-non-normal";
  scene.approach_rad = 25.0 * std::numbers::pi / 180.0;
  return scene;
}

Scene withoutNoise(Scene scene) {
  scene.machine_sigma_mm = 0.0;
  scene.probe_sigma_mm = 0.0;
  return scene;
}

Scene shuffled(Scene scene, Random& random) {
  for (double& component : scene.centre_mm) component = uniform(random, -180.0, 180.0);
  for (double& entry : scene.gain.reshaped()) entry += uniform(random, -0.025, 0.025);
  scene.machine_delay_s = uniform(random, 0.001, 0.008);
  scene.probe_delay_s = uniform(random, 0.0, 0.0005);
  if (!scene.more_delay_s.isZero()) {
    for (double& more : scene.more_delay_s) more = uniform(random, -0.001, 0.003);
  }
  return scene;
}

Dataset measure(const Scene& scene, Random& random) {
  Dataset dataset = touchDataset(scene.method);
  configure(dataset, scene);
  stateExactMachine(dataset);
  Table& machine = dataset.tables[0];
  Table& probe = dataset.tables[1];
  Table& touches = dataset.tables[2];
  double touch = 0.0;
  for (const double speed : scene.speeds_mm_s) {
    for (const auto& normal : scene.normals) {
      const Vector3d retract = scene.approach_rad > 0.0 ? tilted(normal, scene.approach_rad, random) : normal;
      const Contact contact{scene, normal, retract, speed};
      touches.append({touch, normal.x(), normal.y(), normal.z(), retract.x(), retract.y(), retract.z(), speed});
      sample(
          machine, touch, contact.duration(), scene,
          {scene.machine_rate_hz, scene.machine_sigma_mm * scene.sigma_share, scene.machine_resolution_mm,
           scene.more_delay_s.array() + scene.machine_delay_s},
          [&](double t) { return scene.inverse ? scene.inverse(contact.body(t)) : contact.body(t); }, random);
      sample(
          probe, touch, contact.duration(), scene,
          {scene.probe_rate_hz, Vector3d::Constant(scene.probe_sigma_mm), 0.0, Vector3d::Constant(scene.probe_delay_s)},
          [&](double t) { return contact.deflection(t); }, random);
      ++touch;
    }
  }
  return dataset;
}

Dataset moved(Dataset dataset, const Matrix3d& turn, const Vector3d& shift) {
  const auto apply = [&](Table& table, std::size_t first, const Vector3d& by) {
    for (std::size_t row = 0; row < table.rows(); ++row) {
      Vector3d v;
      for (Eigen::Index k = 0; k < 3; ++k) v[k] = table.columns[first + static_cast<std::size_t>(k)].values[row];
      v = turn * v + by;
      for (Eigen::Index k = 0; k < 3; ++k) table.columns[first + static_cast<std::size_t>(k)].values[row] = v[k];
    }
  };
  apply(dataset.tables[0], 2, shift);
  apply(dataset.tables[2], 1, Vector3d::Zero());
  apply(dataset.tables[2], 4, Vector3d::Zero());
  return dataset;
}

Reference referencePrecision(const Scene& scene) {
  const bool each_axis = scene.method == "delay-per-axis";
  const bool size_free = scene.method == "delay-multi-speed";
  // Columns: centre, three delays (the first for all axes but where each has its own), radius.
  Eigen::Matrix<double, 7, 7> fisher = Eigen::Matrix<double, 7, 7>::Zero();
  for (const double speed : scene.speeds_mm_s) {
    for (const auto& normal : scene.normals) {
      const Vector3d arm = scene.radius_mm > 0.0 ? normal : Vector3d{-normal};
      // The point is uncertain along the motion.
      const double seen = std::cos(scene.approach_rad);
      Eigen::Vector<double, 7> row = Eigen::Vector<double, 7>::Zero();
      row.head<3>() = -arm;
      if (each_axis) {
        row.segment<3>(3) = arm.cwiseProduct(normal) * speed;
      } else {
        row[3] = arm.dot(normal) * speed * seen;
      }
      if (size_free) row[6] = -1.0;
      fisher += row * row.transpose() / (pointVariance(scene, speed) * seen * seen);
    }
  }
  const Eigen::MatrixXd covariance = pseudoInverse(fisher);
  return {std::sqrt(covariance(3, 3)), 2.0 * std::sqrt(covariance(6, 6))};
}

}  // namespace probebox::metrology::simulation
