#include "touch_simulation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

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

// One touch along the normal, in physical time.
class Contact {
 public:
  Contact(const Scene& scene, const Vector3d& normal, double speed)
      : scene_{scene},
        normal_{normal},
        surface_{scene.centre_mm + scene.radius_mm * normal},
        in_{scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, true},
        out_{2.0 * scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, false},
        inverse_gain_{scene.gain.inverse()} {
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
  Vector3d body(double t) const { return surface_ + outside(t) * normal_; }
  Vector3d deflection(double t) const {
    const double depth = -outside(t);
    if (depth <= 0.0) return Vector3d::Zero();
    return inverse_gain_ * (normal_ * (depth + ringing(t - kLead - touched_)));
  }

 private:
  double ringing(double since) const {
    return scene_.bounce_mm * std::exp(-since / 0.009) * std::sin(2.0 * std::numbers::pi * 160.0 * since);
  }

  const Scene& scene_;
  Vector3d normal_;
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
  double sigma{};
  double resolution{};
  double delay_s{};
};

void sample(Table& table, double touch, double duration, const Scene& scene, const Sampling& sampling,
            const std::function<Vector3d(double)>& truth, Random& random) {
  const double phase = uniform(random, 0.0, 1.0);
  for (double k = phase; k / sampling.rate_hz < duration; ++k) {
    const double t = k / sampling.rate_hz;
    Vector3d value = truth(t - sampling.delay_s);
    for (double& component : value) {
      component += gaussian(random, sampling.sigma);
      if (sampling.resolution > 0.0) component = std::round(component / sampling.resolution) * sampling.resolution;
    }
    const double stamp = t + gaussian(random, scene.stamp_jitter_s);
    if (uniform(random, 0.0, 1.0) < scene.lost_share) continue;
    table.append({touch, stamp, value.x(), value.y(), value.z()});
  }
}

// (A8): variance of the surface point, mm^2, at one speed.
double pointVariance(const Scene& scene, double speed) {
  const double samples = 0.5 * scene.overtravel_mm / speed * scene.probe_rate_hz;
  const double probe = std::pow(scene.probe_sigma_mm, 2) / samples * (1.0 + 3.0 * std::pow(0.7 / 0.5, 2));
  const double window = 0.75 * scene.overtravel_mm + scene.clearance_mm;
  const double machine_samples = window / speed * scene.machine_rate_hz;
  const double q = (0.75 * scene.overtravel_mm - window / 2.0) / window;
  return probe + std::pow(scene.machine_sigma_mm, 2) / machine_samples * (1.0 + 12.0 * q * q);
}

}  // namespace

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
  return scene;
}

Dataset measure(const Scene& scene, Random& random) {
  Dataset dataset = touchDataset("delay-multi-speed");
  Table& machine = dataset.tables[0];
  Table& probe = dataset.tables[1];
  Table& touches = dataset.tables[2];
  double touch = 0.0;
  for (const double speed : scene.speeds_mm_s) {
    for (const auto& normal : scene.normals) {
      const Contact contact{scene, normal, speed};
      touches.append({touch, normal.x(), normal.y(), normal.z(), normal.x(), normal.y(), normal.z(), speed});
      sample(
          machine, touch, contact.duration(), scene,
          {scene.machine_rate_hz, scene.machine_sigma_mm, scene.machine_resolution_mm, scene.machine_delay_s},
          [&](double t) { return contact.body(t); }, random);
      sample(
          probe, touch, contact.duration(), scene,
          {scene.probe_rate_hz, scene.probe_sigma_mm, 0.0, scene.probe_delay_s},
          [&](double t) { return contact.deflection(t); }, random);
      ++touch;
    }
  }
  return dataset;
}

Reference referencePrecision(const Scene& scene) {
  Eigen::Matrix<double, 5, 5> fisher = Eigen::Matrix<double, 5, 5>::Zero();
  for (const double speed : scene.speeds_mm_s) {
    for (const auto& normal : scene.normals) {
      Eigen::Vector<double, 5> row;
      const Vector3d arm = scene.radius_mm > 0.0 ? normal : Vector3d{-normal};
      row << -arm, -1.0, arm.dot(normal) * speed;
      fisher += row * row.transpose() / pointVariance(scene, speed);
    }
  }
  const Eigen::Matrix<double, 5, 5> covariance = fisher.inverse();
  return {std::sqrt(covariance(4, 4)), 2.0 * std::sqrt(covariance(3, 3))};
}

}  // namespace probebox::metrology::simulation
