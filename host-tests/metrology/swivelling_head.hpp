#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A swivelling head whose gauge line and tool direction are off, read by a control that believes them right.
namespace probebox::metrology {

// The control believes the axis along uB through the reference point and the tool along Z at B = 0.
struct Head {
  Eigen::Vector3d axis{0, 1, 0};
  Eigen::Vector3d gauge{0.010, 0.004, 0.025};    // the gauge line is off by this
  Eigen::Vector3d direction{-1e-4, 5e-5, 2e-4};  // and the tool direction, per mm
  Eigen::Vector3d skew{0, 0, 0};                 // and the swivel axis
  Eigen::Vector3d unexplained{0, 0, 0};          // times sin 2B: what no head of this kind does
  Eigen::Vector3d ball{-0.5, 0.4, 60.0};

  Eigen::Vector3d reported(double b, double length) const {
    const Eigen::Matrix3d believed = Eigen::AngleAxisd{b * kDegree, axis}.toRotationMatrix();
    const Eigen::Matrix3d real = Eigen::AngleAxisd{b * kDegree, (axis + skew).normalized()}.toRotationMatrix();
    const Eigen::Vector3d tool = Eigen::Vector3d{0, 0, length};
    return ball - real * (tool + gauge + length * direction) + believed * tool +
           std::sin(2 * b * kDegree) * unexplained;
  }
  Eigen::Vector3d error(double b, double length) const { return reported(b, length) - reported(0.0, length); }
};

inline Head randomHead(std::mt19937_64& random) {
  const auto vector = [&](double size) {
    return Eigen::Vector3d{uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
  };
  Head head;
  head.gauge = vector(0.03);
  head.direction = vector(2e-4);
  head.skew = vector(1e-4);
  head.skew -= head.axis * head.axis.dot(head.skew);
  head.ball = vector(1.0) + Eigen::Vector3d{0, 0, 60};
  return head;
}

inline const std::vector<double> kQueryAngles{-90, -60, -30, 20, 50, 90};

inline Dataset swivelDataset(const Head& head, const std::vector<double>& angles, const std::vector<double>& lengths,
                             double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "swivel-error",
                  .config = {{"sigma_mm", sigma},
                             {"swivel_axis", std::vector<double>{head.axis.x(), head.axis.y(), head.axis.z()}}},
                  .tables = {}};
  stateExactMachine(dataset);
  Table readings =
      Table::withColumns("readings", std::array<std::string_view, 5>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"});
  Table queries = Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
  for (const double length : lengths) {
    for (const double b : angles) {
      const Eigen::Vector3d at = head.reported(b, length);
      readings.append(
          {b, length, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
    }
  }
  for (const double length : {100.0, 150.0, 200.0}) {
    for (const double b : kQueryAngles) queries.append({b, length});
  }
  dataset.tables = {std::move(readings), std::move(queries)};
  return dataset;
}

// Of the answer at every query.
inline void addErrors(Moments& pull, const Result& result, const Head& head) {
  const auto& errors = *result.find("error_at_queries_mm");
  std::size_t at = 0;
  for (const double length : {100.0, 150.0, 200.0}) {
    for (const double b : kQueryAngles) {
      for (const double truth : head.error(b, length)) {
        pull.add(errors.values[at] - truth, errors.sd[at]);
        ++at;
      }
    }
  }
}

// The largest error of the answer at the queries, mm.
inline double worst(const Result& result, const Head& head) {
  const auto& values = result.find("error_at_queries_mm")->values;
  double worst = 0.0;
  std::size_t at = 0;
  for (const double length : {100.0, 150.0, 200.0}) {
    for (const double b : kQueryAngles) {
      for (const double truth : head.error(b, length)) worst = std::max(worst, std::abs(values[at++] - truth));
    }
  }
  return worst;
}

}  // namespace probebox::metrology
