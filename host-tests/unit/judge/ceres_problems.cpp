#include "ceres_problems.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <stdexcept>
#include <vector>

namespace probebox::judge {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void settle(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = 1e-16;
  options.parameter_tolerance = 1e-15;
  options.initial_trust_region_radius = 1e12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw std::runtime_error{summary.message};
}

// Of parameters that lie one after the other in memory.
void cover(ceres::Problem& problem, const std::vector<const double*>& blocks, Eigen::MatrixXd* covariance) {
  if (!covariance) return;
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.null_space_rank = 0;
  ceres::Covariance found{options};
  std::vector<int> sizes;
  int all = 0;
  for (const double* block : blocks) all += sizes.emplace_back(problem.ParameterBlockSize(block));
  if (!found.Compute(blocks, &problem)) throw std::runtime_error{"no covariance"};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> entries{all, all};
  if (!found.GetCovarianceMatrix(blocks, entries.data())) throw std::runtime_error{"no covariance"};
  *covariance = entries;
}

struct OnSphere {
  Vector3d point;
  template <class T>
  bool operator()(const T* centre, const T* radius, T* off) const {
    off[0] = ceres::hypot(ceres::hypot(point[0] - centre[0], point[1] - centre[1]), point[2] - centre[2]) - radius[0];
    return true;
  }
};

struct OnCircle {
  metrology::RotationReading reading;
  metrology::RotationNoise noise;
  template <class T>
  bool operator()(const T* centre, const T* arm, const T* angle, T* off) const {
    const T turned = reading.angle + noise.angle * angle[0];
    off[0] = (reading.at[0] - centre[0] - cos(turned) * arm[0] + sin(turned) * arm[1]) / noise.position;
    off[1] = (reading.at[1] - centre[1] - sin(turned) * arm[0] - cos(turned) * arm[1]) / noise.position;
    off[2] = angle[0];
    return true;
  }
};

struct Moved {
  Vector3d from;
  Vector3d to;
  template <class T>
  bool operator()(const T* shift, const T* turn, T* off) const {
    const T point[3]{T(from[0]), T(from[1]), T(from[2])};
    T turned[3];
    ceres::AngleAxisRotatePoint(turn, point, turned);
    for (int k = 0; k < 3; ++k) off[k] = to[k] - turned[k] - shift[k];
    return true;
  }
};

struct Touched {
  TouchedPoint touch;
  template <class T>
  bool operator()(const T* centre, const T* radius, const T* delay, T* off) const {
    T arm[3];
    for (int k = 0; k < 3; ++k) arm[k] = touch.at[k] + delay[0] * touch.velocity[k] - centre[k];
    off[0] = (sqrt(arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2]) - radius[0]) / touch.sigma;
    return true;
  }
};

struct TouchedByArm {
  Arm arm;
  ArmTouch seen;

  // Joint j later than the touch by later[j].
  template <class T>
  void tip(const T* later, T* at) const {
    T q[3];
    for (int j = 0; j < 3; ++j) {
      const T s = (later[j] + seen.at_s - seen.joints.t_mean) / seen.joints.half_s;
      const auto& c = seen.joints.coefficients;
      q[j] = c(j, 0) + s * (c(j, 1) + s * c(j, 2));
    }
    at[0] = arm.base[0] + arm.upper * cos(q[0]) + arm.fore * cos(q[0] + q[1]);
    at[1] = arm.base[1] + arm.upper * sin(q[0]) + arm.fore * sin(q[0] + q[1]);
    at[2] = arm.base[2] + q[2];
  }
  template <class T>
  bool operator()(const T* centre, const T* radius, const T* delays, T* off) const {
    const T mean = (delays[0] + delays[1] + delays[2]) / 3.0;
    const T together[3]{mean, mean, mean};
    T own[3];
    T common[3];
    tip(delays, own);
    tip(together, common);
    T squares{0.0};
    for (int k = 0; k < 3; ++k) {
      const T part = seen.touch.at[k] + mean * seen.touch.velocity[k] + own[k] - common[k] - centre[k];
      squares += part * part;
    }
    off[0] = (sqrt(squares) - radius[0]) / seen.touch.sigma;
    return true;
  }
};

struct Tilted {
  TiltedPoint reading;
  template <class T>
  bool operator()(const T* axis, const T* point, T* off) const {
    // About the line through (axis0, axis1, 0) along (axis2, axis3, 1).
    const T length = sqrt(axis[2] * axis[2] + axis[3] * axis[3] + 1.0);
    const T turn[3]{reading.tilt * axis[2] / length, reading.tilt * axis[3] / length, reading.tilt / length};
    const T arm[3]{point[0] - axis[0], point[1] - axis[1], point[2]};
    T turned[3];
    ceres::AngleAxisRotatePoint(turn, arm, turned);
    off[0] = reading.at[0] - axis[0] - turned[0];
    off[1] = reading.at[1] - axis[1] - turned[1];
    off[2] = reading.at[2] - turned[2];
    return true;
  }
};

}  // namespace

Eigen::Vector4d sphere(const metrology::Rows3& points, Eigen::MatrixXd* covariance) {
  Eigen::Vector4d at;
  at << points.colwise().mean().transpose(), 1.0;
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<OnSphere, 1, 3, 1>(new OnSphere{points.row(i)}), nullptr,
                             at.data(), at.data() + 3);
  }
  settle(problem);
  cover(problem, {at.data(), at.data() + 3}, covariance);
  return at;
}

Eigen::Vector4d rotation(std::span<const metrology::RotationReading> readings, const metrology::RotationNoise& noise,
                         Eigen::MatrixXd* covariance) {
  Eigen::Vector4d at = Eigen::Vector4d::Zero();
  for (const auto& reading : readings) at.head<2>() += reading.at / static_cast<double>(readings.size());
  at.tail<2>() = Eigen::Rotation2Dd{-readings[0].angle} * (readings[0].at - at.head<2>());
  std::vector<double> angles(readings.size(), 0.0);
  ceres::Problem problem;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<OnCircle, 3, 2, 2, 1>(new OnCircle{readings[k], noise}),
                             nullptr, at.data(), at.data() + 2, &angles[k]);
  }
  settle(problem);
  cover(problem, {at.data(), at.data() + 2}, covariance);
  return at;
}

Motion rigid(const Eigen::MatrixX3d& from, const Eigen::MatrixX3d& to, Eigen::MatrixXd* covariance) {
  Motion at = Motion::Zero();
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Moved, 3, 3, 3>(new Moved{from.row(i), to.row(i)}),
                             nullptr, at.data(), at.data() + 3);
  }
  settle(problem);
  cover(problem, {at.data(), at.data() + 3}, covariance);
  return at;
}

TouchAnswer touches(std::span<const TouchedPoint> points, const TouchAnswer& start, Eigen::MatrixXd* covariance) {
  TouchAnswer at = start;
  ceres::Problem problem;
  for (const auto& point : points) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Touched, 1, 3, 1, 1>(new Touched{point}), nullptr,
                             at.data(), at.data() + 3, at.data() + 4);
  }
  settle(problem);
  cover(problem, {at.data(), at.data() + 3, at.data() + 4}, covariance);
  return at;
}

ArmAnswer armTouches(const Arm& arm, std::span<const ArmTouch> points, const ArmAnswer& start) {
  ArmAnswer at = start;
  ceres::Problem problem;
  for (const auto& point : points) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<TouchedByArm, 1, 3, 1, 3>(new TouchedByArm{arm, point}),
                             nullptr, at.data(), at.data() + 3, at.data() + 4);
  }
  settle(problem);
  return at;
}

Eigen::VectorXd pivot(std::span<const TiltedPoint> readings, const Eigen::VectorXd& start) {
  Eigen::VectorXd at = start;
  ceres::Problem problem;
  for (const auto& reading : readings) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Tilted, 3, 4, 3>(new Tilted{reading}), nullptr, at.data(),
                             at.data() + 4 + 3 * reading.point);
  }
  settle(problem);
  return at;
}

}  // namespace probebox::judge
