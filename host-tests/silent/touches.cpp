#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/contour_simulation.hpp"
#include "host-tests/metrology/scan_simulation.hpp"
#include "host-tests/metrology/switched_probe.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/metrology/two_link_arm.hpp"
#include "host-tests/silent/worlds.hpp"

// Methods that touch and scan with a probe whose deflection is sampled.
namespace probebox::metrology::silent {
namespace {

using Eigen::Vector3d;
using simulation::Scene;

constexpr double kBetweenTouches_s = 4;

std::vector<double> delaysOf(const Scene& scene) {
  return {scene.tauOf(0), scene.tauOf(1), scene.tauOf(2)};
}

// Of every touch method, as far as it gives these.
std::vector<Truth> truthOf(const Scene& scene) {
  const auto& c = scene.centre_mm;
  const auto gain = scene.gain.reshaped<Eigen::RowMajor>();
  return {{"tau_s", {scene.tau()}},
          {"tau_axis_s", delaysOf(scene)},
          {"centre_mm", {c.x(), c.y(), c.z()}},
          {"gain_matrix", {gain.begin(), gain.end()}}};
}

// Of a vibration that looks like 5 Hz.
double besideTheRate(double machine_rate_hz) {
  return machine_rate_hz - 5;
}

// Errors that the simulation has of its own. A drift is per reading, which here is a touch.
void put(const Errors& errors, Scene& scene) {
  auto& of = scene.errors;
  scene.every_s = kBetweenTouches_s;
  if (errors.has(Err::lost_motion)) of.lost_motion_mm.setConstant(errors.size * kLost_mm);
  if (errors.has(Err::hysteresis)) of.hysteresis_mm = errors.size * kHysteresis_mm;
  if (errors.has(Err::drift)) of.drift_mm_min.setConstant(errors.size * kDrift_mm_per_min);
  if (errors.has(Err::lobing)) of.form_mm = [size = errors.size](const Vector3d& n) { return size * lobe_mm(n); };
  if (errors.has(Err::curvature)) of.curvature_per_mm.setConstant(errors.size * kCurvature / scene.overtravel_mm);
  if (errors.has(Err::vibration)) {
    of.axes_hz = besideTheRate(scene.machine_rate_hz);
    of.axes_amplitude_mm.setConstant(errors.size * kVibration_mm);
  }
}

void misstate(Dataset& dataset, std::string_view key, const Errors& errors) {
  std::get<double>(dataset.config.at(std::string{key})) += errors.size * kBall_mm;
}

constexpr std::array kOfAxes{Err::scale, Err::squareness, Err::uneven_screw};
constexpr std::array kSlips{Err::diameters, Err::inches};

// Those of these kinds alone.
Errors only(const auto& kinds, Errors errors) {
  std::erase_if(errors.kinds, [&](Err err) { return std::ranges::find(kinds, err) == kinds.end(); });
  return errors;
}

bool isOfAxes(const Errors& errors) {
  return !only(kOfAxes, errors).kinds.empty();
}

// One touch meets dirt.
void dirty(Dataset& dataset, Random& random) {
  const Table touches = tableNamed(dataset, "touches");
  const auto row = std::uniform_int_distribution<std::size_t>{0, touches.rows() - 1}(random);
  const auto numbers = columnNamed(dataset, "machine", "touch");
  for (const auto& [place, normal] : {std::pair{"x_mm", "nx"}, {"y_mm", "ny"}, {"z_mm", "nz"}}) {
    auto& values = columnNamed(dataset, "machine", place);
    for (std::size_t sample = 0; sample < values.size(); ++sample)
      if (numbers[sample] == (*touches.column("touch"))[row])
        values[sample] += kOutlier_mm * (*touches.column(normal))[row];
  }
}

// What the axes' own errors do to the places between which the samples lie, and slips.
void disturbStream(Dataset& dataset, const Vector3d& about, const Errors& errors, Random& random) {
  const std::vector<PlacesRead> samples{{.table = "machine"}};
  disturb(dataset, samples, about, only(kOfAxes, errors), random);
  if (errors.has(Err::outlier)) dirty(dataset, random);
  slip(dataset, samples, only(kSlips, errors), random);
}

std::optional<Dataset> touched(Scene& scene, const Errors& errors, Random& random) {
  scene = simulation::shuffled(std::move(scene), random);
  put(errors, scene);
  Dataset dataset = simulation::measure(scene, random);
  const auto* size = scene.method == "delay-plates"                       ? "gap_mm"
                     : dataset.config.contains("stylus_ball_diameter_mm") ? "stylus_ball_diameter_mm"
                                                                          : "effective_diameter_mm";
  if (errors.has(Err::wrong_ball)) {
    if (!dataset.config.contains(size)) return std::nullopt;
    misstate(dataset, size, errors);
  }
  disturbStream(dataset, scene.centre_mm, errors, random);
  return dataset;
}

std::optional<SimulatedCase> delay(Scene scene, const Errors& errors, Random& random) {
  auto dataset = touched(scene, errors, random);
  if (!dataset) return std::nullopt;
  return SimulatedCase{*std::move(dataset), truthOf(scene)};
}

// The default plan of a run of touches: two speeds, and the first touch again.
template <Scene (*scene_of)()>
std::optional<SimulatedCase> atTwoSpeeds(const Errors& errors, Random& random) {
  Scene scene = scene_of();
  const double fast = scene.speeds_mm_s.front();
  for (const double speed : {0.4 * fast, fast})
    for (const auto& normal : scene.normals) scene.visits.push_back({normal, speed});
  scene.visits.push_back(scene.visits.front());
  return delay(std::move(scene), errors, random);
}

template <Scene (*scene_of)()>
std::optional<SimulatedCase> atOneSpeed(const Errors& errors, Random& random) {
  return delay(scene_of(), errors, random);
}

Scene severalSpeeds() {
  return {};
}

std::optional<SimulatedCase> feature(const Errors& errors, Random& random) {
  Scene scene = simulation::knownSphere();
  scene.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0.8, 0.6, 0}};
  scene.speeds_mm_s = {10, 25};
  auto dataset = touched(scene, errors, random);
  dataset->method = "delay-feature";
  auto size = dataset->config.extract("effective_diameter_mm");
  dataset->config["size_mm"] = size.mapped();
  dataset->config["shape"] = std::string{"cylinder"};
  dataset->config["axis_direction"] = std::vector<double>{0, 0, 1};
  return SimulatedCase{*std::move(dataset), {{"tau_s", {scene.tau()}}}};
}

std::optional<SimulatedCase> joints(const Errors& errors, Random& random) {
  const Arm arm;
  Scene scene = metrology::scene(arm);
  if (isOfAxes(errors) || !only(kSlips, errors).kinds.empty() || errors.has(Err::outlier)) return std::nullopt;
  put(errors, scene);
  Dataset dataset = measured(scene, arm, random);
  if (errors.has(Err::wrong_ball)) misstate(dataset, "effective_diameter_mm", errors);
  return SimulatedCase{std::move(dataset), {{"tau_joint_s", delaysOf(scene)}}};
}

std::optional<SimulatedCase> machineCheck(const Errors& errors, Random& random) {
  Scene scene = simulation::machineCheck();
  auto dataset = touched(scene, errors, random);
  if (!dataset) return std::nullopt;
  const auto& of = scene.errors;
  const auto list = [](const Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  return SimulatedCase{*std::move(dataset),
                       {{"tau_axis_s", delaysOf(scene)},
                        {"lost_motion_mm", list(of.lost_motion_mm.array() + of.hysteresis_mm)},
                        {"probe_hysteresis_mm", {of.hysteresis_mm}},
                        {"gain_curvature_per_mm", list(of.curvature_per_mm)},
                        {"machine_drift_um_per_min", list(1e3 * of.drift_mm_min)}}};
}

// ---- Scans

// Of streams that were simulated without errors: what these add to the samples.
void disturbScan(Dataset& dataset, const Vector3d& about, double machine_rate_hz, const Errors& errors,
                 Random& random) {
  const double size = errors.size;
  disturbStream(dataset, about, errors, random);
  const auto each = [&](const char* table, std::array<const char*, 3> names, const auto& change) {
    const auto times = columnNamed(dataset, table, "t_s");
    for (std::size_t row = 0; row < times.size(); ++row) {
      Vector3d at;
      for (std::size_t k = 0; k < 3; ++k)
        at[static_cast<Eigen::Index>(k)] = columnNamed(dataset, table, names.at(k))[row];
      change(times[row], at);
      for (std::size_t k = 0; k < 3; ++k)
        columnNamed(dataset, table, names.at(k))[row] = at[static_cast<Eigen::Index>(k)];
    }
  };
  constexpr std::array kPlace{"x_mm", "y_mm", "z_mm"}, kChannels{"a", "b", "c"};
  if (errors.has(Err::lost_motion)) {
    // An axis stands half of the play behind its encoder, on the side of its motion.
    Vector3d side = Vector3d::Zero(), turn = Vector3d::Constant(std::nan(""));
    each("machine", kPlace, [&](double, Vector3d& at) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        if (std::isnan(turn[k])) turn[k] = at[k];
        // The dead band follows the axis.
        turn[k] = std::clamp(turn[k], at[k] - size * kLost_mm / 2, at[k] + size * kLost_mm / 2);
        side[k] = turn[k] - at[k];
      }
      at -= side;
    });
  }
  if (errors.has(Err::hysteresis)) {
    Vector3d felt = Vector3d::Constant(std::nan(""));
    each("probe", kChannels, [&](double, Vector3d& at) {
      if (std::isnan(felt.x())) felt = at;
      const Vector3d behind = at - felt;
      const double half = size * kHysteresis_mm / 2;
      if (behind.norm() > half) felt = at - half * behind.normalized();
      at = felt;
    });
  }
  if (errors.has(Err::curvature))
    each("probe", kChannels, [&](double, Vector3d& at) { at *= 1 + size * kCurvature * at.norm() / 0.5; });
  if (errors.has(Err::drift))
    each("machine", kPlace, [&](double t, Vector3d& at) { at.array() += size * kDrift_mm_per_min * t / 60; });
  if (errors.has(Err::vibration))
    each("machine", kPlace, [&](double t, Vector3d& at) {
      at.array() += size * kVibration_mm * std::sin(2 * std::numbers::pi * besideTheRate(machine_rate_hz) * t);
    });
  if (errors.has(Err::lobing))
    each("machine", kPlace, [&](double, Vector3d& at) {
      const Vector3d n = (at - about).normalized();
      at += size * lobe_mm(n) * n;
    });
}

std::optional<SimulatedCase> steppedScan(const Errors& errors, Random& random) {
  if (errors.has(Err::outlier)) return std::nullopt;  // no single reading
  simulation::ScanScene scene;
  for (double& error : scene.centre_error_mm) error = gauss(random, 0.005);
  scene.tau_s = uniform(random, 0.001, 0.008);
  Dataset dataset = simulation::measure(scene, random);
  if (errors.has(Err::wrong_ball)) {
    if (!dataset.config.contains("effective_radius_mm")) return std::nullopt;
    std::get<double>(dataset.config["effective_radius_mm"]) += errors.size * kBall_mm / 2;
  }
  disturbScan(dataset, scene.centre_mm, scene.machine_rate_hz, errors, random);
  return SimulatedCase{std::move(dataset), {{"tau_s", {scene.tau_s}}}};
}

std::optional<SimulatedCase> contourScan(const Errors& errors, Random& random) {
  if (errors.has(Err::wrong_ball) || errors.has(Err::outlier)) return std::nullopt;  // no size, no single reading
  contour::Scan scan;
  scan.tau_s = uniform(random, 0.001, 0.008);
  Dataset dataset = contour::measured(contour::ball(), scan, random);
  disturbScan(dataset, contour::kCentre, scan.machine_hz, errors, random);
  return SimulatedCase{std::move(dataset), {{"tau_s", {scan.tau_s}}}};
}

std::optional<SimulatedCase> preTravel(const Errors& errors, Random& random) {
  if (errors.has(Err::curvature) || errors.has(Err::vibration)) return std::nullopt;
  Probe probe;
  if (errors.has(Err::lobing)) probe.cosine_mm += errors.size * kLobing_mm;
  probe.scatter_mm = kNoise_mm;
  const Vector3d centre{100, -50, -200};
  Dataset dataset = metrology::touched(probe, directions(true), centre, random());
  if (errors.has(Err::wrong_ball)) misstate(dataset, "effective_diameter_mm", errors);
  // Every way in stands behind by half of it, and drifts since the first.
  const double half =
      errors.size / 2 *
      ((errors.has(Err::lost_motion) ? kLost_mm : 0) + (errors.has(Err::hysteresis) ? kHysteresis_mm : 0));
  const double drift = errors.has(Err::drift) ? errors.size * kDrift_mm_per_min : 0;  // a touch
  const auto touches = columnNamed(dataset, "machine", "touch");
  for (std::size_t row = 0; row < touches.size(); ++row) {
    const auto touch = static_cast<std::size_t>(touches[row]);
    for (const auto& [name, normal] : {std::pair{"x_mm", "nx"}, {"y_mm", "ny"}, {"z_mm", "nz"}})
      columnNamed(dataset, "machine", name)[row] +=
          drift * touches[row] + half * columnNamed(dataset, "touches", normal)[touch];
  }
  disturbStream(dataset, centre, errors, random);
  return SimulatedCase{std::move(dataset),
                       {{"pre_travel_mm", {probe.mean_mm, probe.cosine_mm, probe.sine_mm, probe.along_mm}}}};
}

}  // namespace

std::span<const World> worldsOfTouches() {
  static constexpr World kWorlds[]{
      {"delay-known-sphere", atTwoSpeeds<simulation::knownSphere>, true},
      {"delay-known-sphere, one speed", atOneSpeed<simulation::knownSphere>, true},
      {"delay-plates", atTwoSpeeds<simulation::plates>},
      {"delay-plates, one speed", atOneSpeed<simulation::plates>},
      {"delay-cylinder", atTwoSpeeds<simulation::bore>},
      {"delay-cube", atTwoSpeeds<simulation::cube>},
      {"delay-per-axis", atTwoSpeeds<simulation::perAxis>, true},
      {"delay-per-axis, one speed", atOneSpeed<simulation::perAxis>, true},
      {"delay-non-normal", atTwoSpeeds<simulation::nonNormal>, true},
      {"delay-non-normal, one speed", atOneSpeed<simulation::nonNormal>},
      {"delay-multi-speed", atOneSpeed<severalSpeeds>, true},
      {"delay-in-out", atTwoSpeeds<simulation::inOut>},
      {"delay-in-out, one speed", atOneSpeed<simulation::inOut>},
      {"delay-feature", feature, true},
      {"delay-joints", joints, true},
      {"delay-stepped-scan", steppedScan, true},
      {"delay-contour", contourScan, true},
      {"pre-travel", preTravel, true},
      {"machine-check", machineCheck, true},
  };
  return kWorlds;
}

}  // namespace probebox::metrology::silent
