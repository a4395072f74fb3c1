#include "firmware/metrology/kinematics/parallel_kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kDelta = 3, kHexapod = 6;
constexpr double kClosed_mm = 1e-10;
constexpr double kShare = 0.5;               // of the gaps may be left after a step
constexpr double kSmallestStep = 1.0 / 256;  // of the way from the reference pose
constexpr double kHeld = 1e-6;               // smallest singular value of the legs' directions against the largest
constexpr double kShortest_mm = 1.0;

Outcome<Leg, Refusal> legOf(const VectorXd& row, const std::string& name) {
  if (row[0] != 0.0 && row[0] != 1.0 && row[0] != 2.0) {
    return Refusal{"bad-flag", name + "kind must be 0 (a strut that changes its length), 1 (a slide) or 2 (a crank)"};
  }
  Leg leg{.kind = static_cast<LegKind>(row[0]),
          .q = row[1],
          .lower = row.segment<3>(2),
          .upper = row.segment<3>(5),
          .direction = row.segment<3>(8),
          .pivot = row.segment<3>(11)};
  if ((leg.upper - leg.lower).norm() < kShortest_mm) {
    return Refusal{"bad-legs", name + "its two ends coincide: give their positions in the platform's reference pose"};
  }
  if (leg.kind == LegKind::strut) return leg;
  if (std::abs(leg.direction.norm() - 1.0) > 1e-3) {
    return Refusal{"bad-direction", name + "the direction (ux,uy,uz) of the joint must have length 1"};
  }
  leg.direction.normalize();
  return leg;
}

}  // namespace

Vector3d Leg::lowerAt(double joint) const {
  if (kind == LegKind::strut) return lower;
  if (kind == LegKind::slide) return lower + (joint - q) * direction;
  return pivot + Eigen::AngleAxisd{joint - q, direction} * (lower - pivot);
}

double Leg::lengthAt(double joint) const {
  return (upper - lower).norm() + (kind == LegKind::strut ? joint - q : 0.0);
}

double Leg::pushOf(double joint, const Vector3d& along) const {
  if (kind == LegKind::strut) return 1.0;
  if (kind == LegKind::slide) return along.dot(direction);
  return along.dot(direction.cross(lowerAt(joint) - pivot));
}

ParallelKinematics::ParallelKinematics(std::vector<Leg> legs, const Vector3d& tip) : legs_{std::move(legs)}, tip_{tip} {
  for (const auto& leg : legs_) arm_mm_ += (leg.upper - tip_).norm() / static_cast<double>(legs_.size());
}

Outcome<ParallelKinematics, Refusal> ParallelKinematics::read(const Dataset& dataset) {
  TRY(const auto table, checkedTable(dataset, "legs", kLegColumns));
  TRY(const auto tip, requiredVector(dataset, "tip_mm"));
  const MatrixXd rows = columnsOf(*table, kLegColumns);
  std::vector<Leg> legs;
  for (Index row = 0; row < rows.rows(); ++row) {
    TRY(const auto leg, legOf(rows.row(row).transpose(), "table 'legs', row " + std::to_string(row + 1) + ": "));
    legs.push_back(leg);
  }
  if (legs.size() != kDelta && legs.size() != kHexapod) {
    return Refusal{"bad-legs", "table 'legs' has " + std::to_string(legs.size()) +
                                   " rows: give three (the arms of a delta, whose platform keeps its orientation) or "
                                   "six (of a hexapod)"};
  }
  const ParallelKinematics machine{std::move(legs), Vector3d{tip.data()}};
  VectorXd reference{machine.size()};
  for (Index k = 0; k < machine.size(); ++k) reference[k] = machine.legs_[static_cast<std::size_t>(k)].q;
  if (!machine.reached(reference)) {
    return Refusal{
        "bad-legs",
        "the legs do not constrain the platform in its reference pose: their directions are linearly dependent"};
  }
  return machine;
}

std::vector<std::string> ParallelKinematics::columns() const {
  std::vector<std::string> names;
  for (const auto& leg : legs_) {
    names.push_back("q" + std::to_string(names.size() + 1) + (leg.kind == LegKind::crank ? "_rad" : "_mm"));
  }
  return names;
}

Vector3d ParallelKinematics::strutOf(Index leg, const Pose& pose, double q) const {
  const Leg& described = legs_[static_cast<std::size_t>(leg)];
  return pose.tip + pose.turned * (described.upper - tip_) - described.lowerAt(q);
}

// How much farther its ends are apart than each strut is long, mm.
ParallelKinematics::PerLeg ParallelKinematics::gaps(const Pose& pose, const PerLeg& q) const {
  PerLeg apart{size()};
  for (Index k = 0; k < size(); ++k) {
    apart[k] = strutOf(k, pose, q[k]).norm() - legs_[static_cast<std::size_t>(k)].lengthAt(q[k]);
  }
  return apart;
}

ParallelKinematics::ByLeg ParallelKinematics::carried(const Pose& pose, const PerLeg& q) const {
  ByLeg rows{size(), size()};
  for (Index k = 0; k < size(); ++k) {
    const Vector3d along = strutOf(k, pose, q[k]).normalized();
    rows.row(k).head<3>() = along.transpose();
    if (legs_.size() == kDelta) continue;
    const Vector3d arm = pose.turned * (legs_[static_cast<std::size_t>(k)].upper - tip_);
    rows.row(k).tail<3>() = arm.cross(along).transpose() / arm_mm_;
  }
  return rows;
}

// By Newton's method, as long as every step takes most of what is left: then no other pose lies between.
std::optional<ParallelKinematics::Pose> ParallelKinematics::closed(Pose pose, const PerLeg& q) const {
  double before = std::numeric_limits<double>::infinity();
  for (;;) {
    const PerLeg apart = gaps(pose, q);
    const auto step = solveInvertible(carried(pose, q), -apart, kHeld);
    if (!step || !(apart.norm() < before * kShare)) return std::nullopt;
    if (apart.norm() < kClosed_mm) return pose;
    before = apart.norm();
    const PerLeg by = *step;
    pose.tip += by.head<3>();
    if (legs_.size() == kDelta) continue;
    const Vector3d turn = by.tail<3>() / arm_mm_;
    if (turn.norm() > 0.0) pose.turned = Eigen::AngleAxisd{turn.norm(), turn.normalized()} * pose.turned;
  }
}

std::optional<ParallelKinematics::Pose> ParallelKinematics::poseAt(const PerLeg& q) const {
  PerLeg reference{size()};
  for (Index k = 0; k < size(); ++k) reference[k] = legs_[static_cast<std::size_t>(k)].q;
  Pose pose{.tip = tip_};
  double done = 0.0, step = 1.0;
  while (done < 1.0) {
    const double next = std::min(1.0, done + step);
    if (const auto there = closed(pose, reference + next * (q - reference))) {
      pose = *there;
      done = next;
      step *= 2.0;
    } else if ((step /= 4.0) < kSmallestStep) {
      return std::nullopt;
    }
  }
  return pose;
}

std::optional<Vector3d> ParallelKinematics::reached(const VectorXd& q) const {
  const auto pose = poseAt(q);
  return pose ? std::optional{pose->tip} : std::nullopt;
}

Matrix3Xd ParallelKinematics::jacobian(const VectorXd& q) const {
  const auto found = poseAt(q);
  if (!found) return Matrix3Xd::Constant(3, size(), std::numeric_limits<double>::quiet_NaN());
  const Pose& pose = *found;
  PerLeg pushes{size()};
  for (Index k = 0; k < size(); ++k) {
    pushes[k] = legs_[static_cast<std::size_t>(k)].pushOf(q[k], strutOf(k, pose, q[k]).normalized());
  }
  const ByLeg pushed = pushes.asDiagonal();
  return solveSquare(carried(pose, q), pushed).topRows(3);
}

}  // namespace probebox::metrology
