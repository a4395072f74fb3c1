#include "firmware/metrology/scan/scan_gain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kIterations = 12;
constexpr double kOwn_s = 0.002;          // to either side, for the rate of the deflection
constexpr double kLongestStep_s = 0.005;  // of the delay in one iteration
constexpr double kLargest = 1.5;          // gain in any direction, and its inverse: no probe is described worse
constexpr std::size_t kFewest = 50;
constexpr Index kOwnUnknowns = 6;  // of all scans: M xx, xy, yy, delay, place x, y; a radius of each follows

// One scan: positions, and deflections by the described gain.
struct Scan {
  std::vector<double> machine_s, x_mm, y_mm, probe_s;
  std::array<std::vector<double>, 3> deflection_mm;

  bool covers(double t_s) const { return t_s - kOwn_s > probe_s.front() && t_s + kOwn_s < probe_s.back(); }
};

std::vector<Scan> scansOf(const Dataset& dataset, const Matrix3d& described) {
  const Table *listed = dataset.table("scans"), *machine = dataset.table("machine"), *probe = dataset.table("probe");
  std::vector<Scan> scans;
  if (listed == nullptr || machine == nullptr || probe == nullptr) return scans;
  for (std::size_t i = 0; i < listed->rows(); ++i) {
    const double id = listed->columns[0].values[i];
    Scan scan;
    for (std::size_t row = 0; row < machine->rows(); ++row) {
      if (machine->columns[0].values[row] != id) continue;
      scan.machine_s.push_back(machine->columns[1].values[row]);
      scan.x_mm.push_back(machine->columns[2].values[row]);
      scan.y_mm.push_back(machine->columns[3].values[row]);
    }
    for (std::size_t row = 0; row < probe->rows(); ++row) {
      if (probe->columns[0].values[row] != id) continue;
      const Vector3d d = described * Vector3d{probe->columns[2].values[row], probe->columns[3].values[row],
                                              probe->columns[4].values[row]};
      scan.probe_s.push_back(probe->columns[1].values[row]);
      for (std::size_t axis = 0; axis < 3; ++axis) scan.deflection_mm[axis].push_back(d[static_cast<Index>(axis)]);
    }
    if (scan.machine_s.size() >= kFewest && scan.probe_s.size() >= kFewest) scans.push_back(std::move(scan));
  }
  return scans;
}

double determinantOf(const Matrix2d& m) {
  return m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
}

// Length of a deflection under M.
double lengthOf(const Vector3d& d, const Matrix2d& squares) {
  return std::sqrt(std::max(0.0, d.head<2>().dot(squares * d.head<2>()) + d.z() * d.z()));
}

class ScanGain {
 public:
  ScanGain(const std::vector<Scan>& scans, const Vector3d& centre_mm)
      : scans_{scans},
        centre_mm_{centre_mm},
        unknowns_{VectorXd::Zero(kOwnUnknowns + static_cast<Index>(scans.size()))} {
    unknowns_[0] = unknowns_[2] = 1;
  }

  // False when the scans leave an unknown open.
  bool improve() {
    MatrixXd normal = MatrixXd::Zero(unknowns_.size(), unknowns_.size());
    VectorXd right = VectorXd::Zero(unknowns_.size());
    for (std::size_t scan = 0; scan < scans_.size(); ++scan) add(scan, normal, right);
    const auto step = solutionIfInvertible(normal, right);
    if (!step || !step->allFinite()) return false;
    unknowns_ -= *step;
    const double before_s = unknowns_[3] + (*step)[3];
    unknowns_[3] = std::clamp(unknowns_[3], before_s - kLongestStep_s, before_s + kLongestStep_s);
    return true;
  }
  Matrix2d squares() const { return Matrix2d{{unknowns_[0], unknowns_[1]}, {unknowns_[1], unknowns_[2]}}; }

 private:
  void add(std::size_t number, MatrixXd& normal, VectorXd& right) const {
    const Scan& scan = scans_[number];
    const Matrix2d m = squares();
    std::array<std::size_t, 3> cursors{};  // for the deflection, just before it and just behind it
    const auto deflection = [&](double t_s, std::size_t cursor) {
      Vector3d d;
      const std::size_t from = cursors[cursor];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        cursors[cursor] = from;
        d[static_cast<Index>(axis)] = between(scan.probe_s, scan.deflection_mm[axis], t_s, cursors[cursor]);
      }
      return d;
    };
    VectorXd row = VectorXd::Zero(unknowns_.size());
    row[kOwnUnknowns + static_cast<Index>(number)] = -1;
    for (std::size_t i = 0; i < scan.machine_s.size(); i += strideOf(scan.machine_s.size())) {
      const double t_s = scan.machine_s[i] - unknowns_[3];
      if (!scan.covers(t_s)) continue;
      const Vector3d d = deflection(t_s, 0);
      const double length_mm = lengthOf(d, m);
      const double rate =
          (lengthOf(deflection(t_s + kOwn_s, 2), m) - lengthOf(deflection(t_s - kOwn_s, 1), m)) / (2 * kOwn_s);
      const Eigen::Vector2d off{scan.x_mm[i] - centre_mm_.x(), scan.y_mm[i] - centre_mm_.y()};
      if (!(length_mm > 0) || !(off.norm() > 0)) continue;
      const Eigen::Vector2d n = off.normalized();
      row.head<kOwnUnknowns>() << d.x() * d.x() / (2 * length_mm), d.x() * d.y() / length_mm,
          d.y() * d.y() / (2 * length_mm), -rate, -n.x(), -n.y();
      const double radius_mm = unknowns_[kOwnUnknowns + static_cast<Index>(number)];
      const double error_mm = off.norm() + length_mm - radius_mm - n.dot(unknowns_.segment<2>(4));
      normal += row * row.transpose();
      right += row * error_mm;
    }
  }

  const std::vector<Scan>& scans_;
  Vector3d centre_mm_;
  VectorXd unknowns_;
};

}  // namespace

std::optional<Matrix3d> scanGain(const Dataset& dataset, const Vector3d& centre_mm, const Matrix3d& described) {
  const auto scans = scansOf(dataset, described);
  if (scans.empty()) return std::nullopt;
  ScanGain gain{scans, centre_mm};
  for (int i = 0; i < kIterations; ++i) {
    if (!gain.improve()) return std::nullopt;
  }
  // The symmetric root of M.
  const Matrix2d m = gain.squares();
  const double determinant = determinantOf(m), trace = m.trace();
  if (!(determinant > 0) || !(trace > 0)) return std::nullopt;
  const double root = std::sqrt(determinant);
  const Matrix2d in_plane = (m + root * Matrix2d::Identity()) / std::sqrt(trace + 2 * root);
  const double middle = in_plane.trace() / 2,
               spread = std::sqrt(std::max(0.0, middle * middle - determinantOf(in_plane)));
  if (middle + spread > kLargest || middle - spread < 1 / kLargest) return std::nullopt;
  Matrix3d whole = Matrix3d::Identity();
  whole.topLeftCorner<2, 2>() = in_plane;
  return Matrix3d{whole * described};
}

}  // namespace probebox::metrology
