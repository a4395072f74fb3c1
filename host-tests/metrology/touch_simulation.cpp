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
  // begins_s: in the run; ways_mm: what the ways in and out are off by.
  Contact(const Scene& scene, const Vector3d& normal, const Vector3d& retract, double speed, double begins_s,
          const Eigen::Vector2d& ways_mm)
      : scene_{scene},
        normal_{normal},
        begins_s_{begins_s},
        ways_mm_{ways_mm},
        retract_{retract},
        surface_{scene.centre_mm + scene.extent_mm(normal) * normal},
        in_{scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, true},
        out_{2.0 * scene.clearance_mm + scene.overtravel_mm, speed, scene.acceleration_mm_s2, false},
        inverse_gain_{inverse(scene.gain)} {
    const double reach = 0.5 * speed * speed / scene.acceleration_mm_s2;
    touched_ = speed / scene.acceleration_mm_s2 + (scene.clearance_mm - reach) / speed;
    if (scene.errors.form_mm) surface_ += scene.errors.form_mm(normal) * normal;
    // Where the body meets the surface, which without errors is the same.
    double early = kLead, late = kLead + in_.duration();
    for (int step = 0; step < 50; ++step) {
      const double middle = 0.5 * (early + late);
      (depth(middle, surfaceAt(middle)) < 0 ? early : late) = middle;
    }
    met_ = late;
    if (std::abs(met_ - kLead - touched_) > 1e-9) touched_ = met_ - kLead;
    stuck_ = body(met_);
  }

  static constexpr double kLead = 0.003;  // s at rest before the drive
  double duration() const { return kLead + in_.duration() + scene_.dwell_s + out_.duration(); }

  // Distance outside the surface along the way; negative when the tip is pressed on.
  double outside(double t) const {
    const double since = t - kLead;
    const double back = out_.at(since - in_.duration() - scene_.dwell_s);
    return scene_.clearance_mm - in_.at(since) + back;
  }
  // What encoders without a delay show.
  Vector3d shown(double t) const {
    return drivenFrom() + outside(t) * retract_ + sway(t, scene_.errors.axes_hz, scene_.errors.axes_amplitude_mm);
  }
  // The axes lag behind by half of their play, and reverse when the drive has gone through it.
  Vector3d body(double t) const {
    Vector3d at = shown(t);
    const double back = out_.at(t - kLead - in_.duration() - scene_.dwell_s);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double play = scene_.errors.lost_motion_mm[k];
      const double behind = 0.5 * play - std::min(play, std::abs(retract_[k]) * back);
      at[k] += retract_[k] > 0.0 ? behind : -behind;
    }
    return at + ways_mm_[back > 0.0 ? 1 : 0] * retract_;
  }
  // Of the stylus ball against the probe's body, along the machine's axes.
  Vector3d displacement(double t) const {
    if (t < met_ || depth(t, stuckAt(t)) <= 0.0) return Vector3d::Zero();
    return stuckAt(t) - body(t) + ringing(t - kLead - touched_) * retract_;
  }
  Vector3d zero(double t) const {
    return (begins_s_ + t) / 60.0 * scene_.errors.zero_drift_mm_min +
           sway(t, scene_.errors.probe_hz, scene_.errors.probe_amplitude_mm);
  }
  Vector3d channels(const Vector3d& displaced) const {
    Vector3d channels = inverse_gain_ * displaced;
    for (Eigen::Index k = 0; k < 3; ++k) channels[k] *= 1.0 + scene_.errors.curvature_per_mm[k] * std::abs(channels[k]);
    return channels;
  }

 private:
  // The controller goes by the nominal sphere.
  Vector3d drivenFrom() const {
    const Vector3d beside = scene_.aim_mm - scene_.aim_mm.dot(normal_) * normal_;
    return scene_.centre_mm + beside + scene_.extent_mm(normal_) * normal_;
  }
  Vector3d surfaceAt(double t) const { return surface_ + (begins_s_ + t) / 60.0 * scene_.errors.drift_mm_min; }
  Vector3d stuckAt(double t) const { return stuck_ + (t - met_) / 60.0 * scene_.errors.drift_mm_min; }
  double depth(double t, const Vector3d& of) const { return normal_.dot(of - body(t)); }
  Vector3d sway(double t, double hertz, const Vector3d& amplitude_mm) const {
    if (hertz == 0.0) return Vector3d::Zero();
    return std::sin(2.0 * std::numbers::pi * hertz * (begins_s_ + t)) * amplitude_mm;
  }
  double ringing(double since) const {
    const double swing = std::sin(2.0 * std::numbers::pi * 160.0 * since);
    return scene_.bounce_mm * std::exp(-since / 0.009) * (scene_.bounces_off ? std::abs(swing) : swing);
  }

  const Scene& scene_;
  Vector3d normal_;
  double begins_s_;
  Eigen::Vector2d ways_mm_;
  Vector3d retract_;
  Vector3d surface_;
  Drive in_;
  Drive out_;
  Matrix3d inverse_gain_;
  double touched_{};
  double met_{};    // s, when the ball meets the surface
  Vector3d stuck_;  // the body then
};

// Springs with friction rest until the stylus is half of the hysteresis away from what they show.
class Springs {
 public:
  explicit Springs(double hysteresis_mm) : drag_mm_{0.5 * hysteresis_mm} {}
  const Vector3d& at(const Vector3d& displaced) {
    const Vector3d behind = displaced - felt_;
    if (behind.norm() > drag_mm_) felt_ = displaced - drag_mm_ * behind.normalized();
    return felt_;
  }

 private:
  double drag_mm_;
  Vector3d felt_ = Vector3d::Zero();
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

void sample(Table& table, double touch, double begins_s, double duration, const Scene& scene, const Sampling& sampling,
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
    table.append({touch, begins_s + stamp, value.x(), value.y(), value.z()});
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
  } else if (scene.method == "delay-cylinder") {
    dataset.config["diameter_mm"] =
        2.0 * std::abs(scene.radius_mm) + (scene.radius_mm < 0.0 ? kStylusBall : -kStylusBall);
    dataset.config["stylus_ball_diameter_mm"] = kStylusBall;
  } else if (scene.method == "delay-cube") {
    const Vector3d edges = 2.0 * scene.half_edges_mm.array() - kStylusBall;
    dataset.config["edges_mm"] = std::vector<double>{edges.begin(), edges.end()};
    dataset.config["stylus_ball_diameter_mm"] = kStylusBall;
  } else if (scene.method != "delay-multi-speed" && scene.method != "delay-in-out") {
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

Scene bore() {
  Scene scene = knownSphere();
  scene.method = "delay-cylinder";
  scene.radius_mm = -12.0;
  scene.normals.pop_back();
  return scene;
}

Scene cube() {
  Scene scene = knownSphere();
  scene.method = "delay-cube";
  scene.half_edges_mm = {13.0, 15.0, 12.0};
  scene.aim_mm = {3.0, -2.0, 2.5};
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

Scene inOut() {
  Scene scene = knownSphere();
  scene.method = "delay-in-out";
  scene.normals = {{1, 0, 0}};
  scene.dwell_s = 0.0;
  scene.bounce_mm = 0.0;
  return scene;
}

Scene machineCheck() {
  Scene scene;
  scene.method = "machine-check";
  scene.every_s = 4.0;
  scene.dwell_s = 0.1;
  std::vector<Vector3d> pattern{{0, 0, 1}};
  constexpr double kStep = std::numbers::pi / 8.0;
  for (int ring = 1; ring <= 4; ++ring) {
    const int count = ring % 2 == 1 ? 4 : 8;
    const double down = ring * kStep;
    for (int k = 0; k < count; ++k) {
      const double around = (ring - 1) * kStep + 2.0 * std::numbers::pi * k / count;
      pattern.emplace_back(std::sin(down) * std::cos(around), std::sin(down) * std::sin(around), std::cos(down));
    }
  }
  const auto add = [&](std::span<const Vector3d> normals) {
    for (const double speed : {8.0, 25.0})
      for (const auto& normal : normals) scene.visits.push_back({normal, speed});
  };
  add(scene.normals);
  add(std::span{pattern}.first(13));
  add(scene.normals);
  add(std::span{pattern}.subspan(13));
  add(scene.normals);
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
  Table& machine = dataset.tables[0];
  Table& probe = dataset.tables[1];
  Table& touches = dataset.tables[2];
  auto visits = scene.visits;
  for (const double speed : scene.speeds_mm_s)
    for (const auto& normal : scene.normals)
      if (scene.visits.empty()) visits.push_back({normal, speed});
  Springs springs{scene.errors.hysteresis_mm};
  double touch = 0.0;
  for (const auto& [normal, speed] : visits) {
    const Vector3d retract = scene.approach_rad > 0.0 ? tilted(normal, scene.approach_rad, random) : normal;
    const double way_in = gaussian(random, scene.errors.scatter_mm),
                 way_out = gaussian(random, scene.errors.scatter_mm);
    const double begins_s = touch * scene.every_s;
    const Contact contact{scene, normal, retract, speed, begins_s, {way_in, way_out}};
    touches.append({touch, normal.x(), normal.y(), normal.z(), retract.x(), retract.y(), retract.z(), speed});
    sample(
        machine, touch, begins_s, contact.duration(), scene,
        {scene.machine_rate_hz, scene.machine_sigma_mm * scene.sigma_share, scene.machine_resolution_mm,
         scene.more_delay_s.array() + scene.machine_delay_s},
        [&](double t) { return scene.inverse ? scene.inverse(contact.shown(t)) : contact.shown(t); }, random);
    sample(
        probe, touch, begins_s, contact.duration(), scene,
        {scene.probe_rate_hz, Vector3d::Constant(scene.probe_sigma_mm), 0.0, Vector3d::Constant(scene.probe_delay_s)},
        [&](double t) { return contact.channels(springs.at(contact.displacement(t)) + contact.zero(t)); }, random);
    ++touch;
  }
  stateExactMachine(dataset);
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
