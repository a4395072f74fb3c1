#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One stream during one touch, at its native rate with increasing stamps.
struct Stream {
  std::vector<double> times;               // s, master clock
  Rows3 values;                            // machine: mm; probe: raw channels
  std::optional<Eigen::Vector3d> steps{};  // of the record, where its values were changed since: see stepsOf

  std::span<const double> timesOf(Run run) const { return std::span{times}.subspan(run.begin, run.size()); }
  Eigen::Ref<const Rows3> valuesOf(Run run) const {
    return values.middleRows(static_cast<Eigen::Index>(run.begin), static_cast<Eigen::Index>(run.size()));
  }
  // Mean interval of the samples, s; 0 for fewer than two.
  double period() const;
  // Projections onto a direction.
  std::vector<double> along(const Eigen::Vector3d& direction, Run run) const;
};

// Some rows of a table, in their order. columns: what the rows are by, t_s, and three values.
Stream streamOf(const Table& table, const ColumnNames& columns, std::span<const std::size_t> rows);

// The planned touch.
struct TouchPlan {
  std::string name;         // "touch 7"
  Eigen::Vector3d normal;   // of the surface, outward, unit
  Eigen::Vector3d retract;  // unit direction of the retract
  double speed_mm_s{};      // nominal
};

// One approach to the surface and the retract.
struct Touch {
  TouchPlan plan;
  Stream machine;
  Stream probe;
  Eigen::MatrixXd joints{};  // rad or mm, one row per machine stamp; empty for Cartesian axes
};

class Kinematics;

// Groups the tables machine, probe and touches by touch, in the order of the table of touches.
// Refuses what checkedTable refuses, and: duplicated-touch, unknown-touch, missing-touch (a touch without samples: a
// truncated record), duplicated-sample, time-not-rising (by half a period or more: less is jitter), duplicated-reading
// (two touches with the same samples), bad-direction, bad-speed, truncated (the streams of one touch cover different
// times).
Outcome<std::vector<Touch>, Refusal> readTouches(const Dataset& dataset);

// Reads a table machine of joint positions and converts them to tip positions by the forward kinematics.
Outcome<std::vector<Touch>, Refusal> readJointTouches(const Dataset& dataset, const Kinematics& kinematics);

}  // namespace probebox::metrology
