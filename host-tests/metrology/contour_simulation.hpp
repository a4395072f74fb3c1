#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/scan_simulation.hpp"

// Scans along features of any shape: the tip follows the surface, the machine steps towards it and away.
namespace probebox::metrology::contour {

// A place of the surface, and where it faces.
struct Surface {
  Eigen::Vector3d at;
  Eigen::Vector3d normal;
};

// A feature as it is walked along: `way` in mm.
struct Feature {
  std::string shape;
  std::function<Surface(double way)> walk;
  Eigen::Vector3d axis{0.0, 0.0, 0.0};  // none
  Eigen::Vector3d box{0.0, 0.0, 0.0};   // none
  bool internal{};
};

inline const Eigen::Vector3d kCentre{40.0, -25.0, 12.0};

inline Feature ball() {
  return {"sphere", [](double way) {
            // Down a meridian that leans, and about it.
            const double a = way / 30.0;
            const Eigen::Vector3d n = Eigen::Vector3d{std::cos(a), 0.8 * std::sin(a), 0.6 * std::sin(a)}.normalized();
            return Surface{kCentre + 30.0 * n, n};
          }};
}

inline Feature post(bool bore) {
  const Eigen::Vector3d axis = Eigen::Vector3d{0.1, -0.2, 1.0}.normalized();
  const Eigen::Vector3d across = axis.unitOrthogonal();
  return {"cylinder",
          [=](double way) {
            const Eigen::Vector3d n = Eigen::AngleAxisd{way / 25.0, axis} * across;
            return Surface{kCentre + 25.0 * n + 0.1 * way * axis, bore ? Eigen::Vector3d{-n} : n};
          },
          axis, Eigen::Vector3d::Zero(), bore};
}

inline Feature face() {
  const Eigen::Vector3d normal = Eigen::Vector3d{0.2, 0.3, 0.9}.normalized();
  return {"plane", [=](double way) { return Surface{kCentre + way * normal.unitOrthogonal(), normal}; }, normal};
}

// One of the faces of a gap.
inline Feature gap() {
  const Eigen::Vector3d normal = Eigen::Vector3d{0.2, 0.3, 0.9}.normalized();
  return {"plane-pair",
          [=](double way) {
            return Surface{kCentre + 20.0 * normal + way * normal.unitOrthogonal(), -normal};
          },
          normal, Eigen::Vector3d::Zero(), true};
}

// Along one face, about the edge and along the next one.
inline Feature block() {
  const Eigen::Vector3d size{80.0, 50.0, 40.0};
  return {"box",
          [=](double way) {
            constexpr double kEdge = 3.0;  // mm of way about it
            const double along = 45.0;     // before it
            const Eigen::Vector3d edge = kCentre + Eigen::Vector3d{40.0, 25.0, 3.0};
            const double turn = std::clamp((way - along) / kEdge, 0.0, 1.0) * std::numbers::pi / 2.0;
            const Eigen::Vector3d n{std::cos(turn), std::sin(turn), 0.0};
            const Eigen::Vector3d before{0.0, std::min(way - along, 0.0), 0.0};
            const Eigen::Vector3d after{-std::max(way - along - kEdge, 0.0), 0.0, 0.0};
            return Surface{edge + before + after, n};
          },
          Eigen::Vector3d::Zero(), size};
}

inline std::vector<Feature> features() {
  return {ball(), post(false), post(true), face(), gap(), block()};
}

struct Scan {
  double tau_s{0.0034};
  double machine_hz{500.0};
  double probe_hz{1000.0};
  double machine_sigma{0.0005};
  double probe_sigma{0.0004};
  double speed{30.0};
  double duration{3.0};
  double step_mm{0.2};
  double rise_s{0.04};
  double stylus_ball{3.0};
  double least_press{0.1};
  std::vector<std::pair<double, double>> steps{{0.3, 0.7}, {1.05, 1.3}, {1.75, 2.6}};
  Eigen::Vector3d off{0.0, 0.0, 0.0};  // the stated centre from the true one

  static double eased(double share) {
    const double u = std::clamp(share, 0.0, 1.0);
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
  }
  // How far the tip is pressed.
  double press(double t) const {
    double share = 0.0;
    for (const auto& [from, until] : steps) share += eased((t - from) / rise_s) - eased((t - until) / rise_s);
    return least_press + step_mm * share;
  }
  // (A17b)
  double bound() const {
    const double information = 2.0 * static_cast<double>(steps.size()) * 10.0 / 7.0 * step_mm * step_mm / rise_s;
    return std::sqrt((machine_sigma * machine_sigma / machine_hz + probe_sigma * probe_sigma / probe_hz) / information);
  }
};

inline std::vector<double> listed(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

inline Dataset measured(const Feature& feature, const Scan& scan, std::mt19937_64& random) {
  Dataset dataset{
      .method = "delay-contour", .config = {{"shape", feature.shape}, {"search_window_s", 0.05}}, .tables = {}};
  stateExactMachine(dataset);
  if (feature.shape != "plane") dataset.config["centre_mm"] = listed(kCentre + scan.off);
  if (!feature.axis.isZero()) dataset.config["axis_direction"] = listed(feature.axis);
  if (!feature.box.isZero()) dataset.config["size_axis_mm"] = listed(feature.box);
  if (feature.internal) dataset.config["feature"] = std::string{"internal"};
  addTable(dataset, "scans", {"scan", "speed_mm_s"}).append({0.0, scan.speed});
  const auto surface = [&](double t) { return feature.walk(scan.speed * t); };
  Table machine = Table::withColumns("machine", std::array<std::string_view, 5>{"scan", "t_s", "x_mm", "y_mm", "z_mm"});
  for (double t = uniform(random, 0, 1) / scan.machine_hz; t < scan.duration; t += 1.0 / scan.machine_hz) {
    const Surface here = surface(t - scan.tau_s);
    const Eigen::Vector3d at = here.at + (scan.stylus_ball - scan.press(t - scan.tau_s)) * here.normal;
    const auto noise = [&] { return gauss(random, scan.machine_sigma); };
    machine.append({0.0, t, at.x() + noise(), at.y() + noise(), at.z() + noise()});
  }
  Table probe = Table::withColumns("probe", std::array<std::string_view, 5>{"scan", "t_s", "a", "b", "c"});
  for (double t = uniform(random, 0, 1) / scan.probe_hz; t < scan.duration; t += 1.0 / scan.probe_hz) {
    const Eigen::Vector3d bent = scan.press(t) * surface(t).normal;
    const auto noise = [&] { return gauss(random, scan.probe_sigma); };
    probe.append({0.0, t, bent.x() + noise(), bent.y() + noise(), bent.z() + noise()});
  }
  dataset.tables.push_back(std::move(machine));
  dataset.tables.push_back(std::move(probe));
  return dataset;
}

}  // namespace probebox::metrology::contour
