#include "host-tests/metrology/scan_simulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "firmware/metrology/fit/decompositions.hpp"
#include "host-tests/metrology/exact_machine.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology::simulation {
namespace {

using Eigen::Vector3d;

// From 0 to 1 with the least jerk.
double eased(double share) {
  const double u = std::clamp(share, 0.0, 1.0);
  return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
}

double radiusAt(const ScanScene& scene, double angle) {
  const double within = angle - kTurn * std::floor(angle / kTurn);
  double share = 0.0;
  for (const auto& [from, until] : scene.arcs_rad) {
    share += eased((within - from) / scene.transition_rad) - eased((within - until) / scene.transition_rad);
  }
  return scene.outer_mm - share * (scene.outer_mm - scene.inner_mm);
}

double gauss(std::mt19937_64& random, double sigma) {
  return sigma > 0.0 ? std::normal_distribution<double>{0.0, sigma}(random) : 0.0;
}

struct Stream {
  double rate_hz{};
  double sigma{};
  double resolution{};
  double delay_s{};
};

void sample(Table& table, double scan, double duration, const ScanScene& scene, const Stream& stream,
            const std::function<Vector3d(double)>& truth, std::mt19937_64& random) {
  std::uniform_real_distribution<double> share{0.0, 1.0};
  Vector3d noise = Vector3d::Zero();
  double fresh = 1.0;
  for (double t = share(random) / stream.rate_hz; t < duration; t += 1.0 / stream.rate_hz) {
    Vector3d value = truth(t - stream.delay_s);
    for (Eigen::Index k = 0; k < 3; ++k) {
      double& component = value[k];
      noise[k] = scene.correlation * noise[k] + fresh * gauss(random, stream.sigma);
      component += noise[k];
      if (stream.resolution > 0.0) component = std::round(component / stream.resolution) * stream.resolution;
    }
    fresh = std::sqrt(1.0 - scene.correlation * scene.correlation);
    const double stamp = t + gauss(random, scene.stamp_jitter_s);
    if (share(random) < scene.lost_share) continue;
    table.append({scan, stamp, value.x(), value.y(), value.z()});
  }
}

}  // namespace

double ScanScene::bound_s() const {
  double information = 0.0;
  for (const double speed : speeds_mm_s) {
    // The square of the rate over one step of the least jerk.
    const double of_step = 10.0 / 7.0 * std::pow(outer_mm - inner_mm, 2) * speed / (transition_rad * outer_mm);
    information += 2.0 * static_cast<double>(arcs_rad.size()) * of_step;
  }
  const double noise = std::pow(machine_sigma_mm, 2) / machine_rate_hz + std::pow(probe_sigma_mm, 2) / probe_rate_hz;
  return std::sqrt(noise / information);
}

Dataset measure(const ScanScene& scene, std::mt19937_64& random) {
  constexpr std::array<std::string_view, 5> kMachine{"scan", "t_s", "x_mm", "y_mm", "z_mm"};
  constexpr std::array<std::string_view, 5> kProbe{"scan", "t_s", "a", "b", "c"};
  constexpr std::array<std::string_view, 2> kScans{"scan", "speed_mm_s"};
  const Vector3d stated = scene.centre_mm + scene.centre_error_mm;
  Matrix gain;
  for (const auto& row : scene.gain.rowwise()) gain.push_back({row.begin(), row.end()});
  Dataset dataset{.method = "delay-stepped-scan",
                  .config = {{"centre_mm", std::vector<double>{stated.begin(), stated.end()}},
                             {"search_window_s", scene.window_s},
                             {"gain_matrix", gain}},
                  .tables = {Table::withColumns("machine", kMachine), Table::withColumns("probe", kProbe),
                             Table::withColumns("scans", kScans)}};
  stateExactMachine(dataset);
  const Eigen::Matrix3d raw = inverse(scene.gain);
  double scan = 0.0;
  for (const double speed : scene.speeds_mm_s) {
    const double turning = speed / scene.outer_mm;
    const double duration = kTurn * scene.turns / turning;
    const auto outward = [&](double t) { return Vector3d{std::cos(turning * t), std::sin(turning * t), 0.0}; };
    const auto radius = [&](double t) { return radiusAt(scene, turning * t); };
    sample(
        dataset.tables[0], scan, duration, scene,
        {scene.machine_rate_hz, scene.machine_sigma_mm, scene.machine_resolution_mm, scene.tau_s},
        [&](double t) { return Vector3d{scene.centre_mm + radius(t) * outward(t)}; }, random);
    sample(
        dataset.tables[1], scan, duration, scene, {scene.probe_rate_hz, scene.probe_sigma_mm, 0.0, 0.0},
        [&](double t) { return Vector3d{raw * (scene.sphere_mm - radius(t)) * outward(t)}; }, random);
    dataset.tables[2].append({scan, speed});
    ++scan;
  }
  return dataset;
}

}  // namespace probebox::metrology::simulation
