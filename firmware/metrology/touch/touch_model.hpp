#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch_noise.hpp"
#include "firmware/metrology/touch/touched_shape.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// How the gain of the probe enters.
enum class Gain {
  common,    // one matrix A for all touches (A3): its slopes are pooled, and each touch needs only its mean deflection
  by_touch,  // own slope of each touch (A6): for a gain that depends on speed or direction
};

// One delay for all machine axes, one each for x, y and z, or one per joint.
enum class Delays { common, each_axis, each_joint };

// The unknowns of a fit, and the known quantities.
struct TouchQuestion {
  Delays delays{Delays::common};
  std::optional<double> size_mm{};  // effective, 2 R, of a box the mean of its edges; fitted if absent
  TouchedShape shape{};
  double lost_mm{};  // lost motion of the axes, where one speed does not tell it
  Gain gain{Gain::common};
  const Kinematics* kinematics{};  // for non-Cartesian machines; must outlive the question

  Eigen::Index delayCount() const {
    return delays == Delays::common ? 1 : delays == Delays::each_axis ? 3 : kinematics->size();
  }
};

// d point / d tau, one column per delay, for a point of a touch at a time (s) of its machine line, with these delays.
Eigen::Matrix3Xd dPointPerDelay(const Retract& touch, const TouchQuestion& question, double t,
                                const Eigen::VectorXd& tau);

// Orthonormal basis of the span of the rows (unit vectors). flat: singular value, relative to the largest, below which
// a direction is ignored; 0.05 merges directions closer than about three degrees.
inline constexpr double kFlat = 0.05;
Eigen::MatrixXd spanOf(const Eigen::MatrixXd& rows, double flat = kFlat);

// The general touch model (A12) for least squares. Parameters: c in the span of the normals, R unless known, tau (one
// or three), then (common gain) A on the span of the deflections, column by column. Rows of a touch: with a common gain
// the three of A d' + v, then the radial one, |M + T v - c| - R.
class TouchModel {
 public:
  TouchModel(std::span<const Retract> retracts, const PooledNoise& noise, const TouchQuestion& question);

  Eigen::Index size() const { return static_cast<Eigen::Index>(retracts_.size()); }
  Eigen::Index dimensions() const { return span_.cols(); }
  Eigen::Index rowsOfTouch() const { return question_.gain == Gain::common ? 4 : 1; }
  const Eigen::MatrixXd& span() const { return span_; }
  Eigen::Index tauAt() const { return dimensions() + (question_.size_mm ? 0 : 1); }
  Eigen::Index gainAt() const { return tauAt() + question_.delayCount(); }
  Eigen::Index parameters() const { return gainAt() + (question_.gain == Gain::common ? 3 * channels_.cols() : 0); }
  double radius(const Eigen::VectorXd& at) const {
    return question_.size_mm ? *question_.size_mm / 2.0 : at[tauAt() - 1];
  }
  // A (A3) of a common gain; its columns lie in the span of the deflections.
  Eigen::Matrix3d gain(const Eigen::VectorXd& at) const;
  // Orthonormal directions of deflection, raw channels; A = (parameters from gainAt(), 3 to a column) channels'.
  const Eigen::MatrixXd& channels() const { return channels_; }

  // Starting values close enough to converge. Refuses: one-sided, coplanar, not-reachable, and what fitSizeLine
  // refuses.
  Outcome<Eigen::VectorXd, Refusal> start() const;
  // Sets the weights, which depend weakly on the parameters, at these parameters.
  void weighAt(const Eigen::VectorXd& at);
  Linearised operator()(const Eigen::VectorXd& at) const;
  // Change of each parameter, one row each, when one touch, one column each, lies 1 mm further along its
  // normal.
  Eigen::MatrixXd perShift(const Fit& fit) const;

  // One per touch, mm, mm/s and mm: radial residual, outward speed, and radial residual of the point at rest at the
  // apex.
  Eigen::VectorXd radial(const Eigen::VectorXd& at) const;
  Eigen::VectorXd normalSpeed(const Eigen::VectorXd& at) const;
  Eigen::VectorXd radialAtApex(const Eigen::VectorXd& at) const;

 private:
  const Retract& touch(Eigen::Index i) const { return retracts_[static_cast<std::size_t>(i)]; }
  const TouchNoise& noiseOf(Eigen::Index i) const { return noise_.of_touch[static_cast<std::size_t>(i)]; }
  Eigen::VectorXd delays(const Eigen::VectorXd& at) const { return at.segment(tauAt(), question_.delayCount()); }
  Eigen::Matrix3d velocityShare(Eigen::Index i, const Eigen::VectorXd& at) const;
  // Machine position at the point's time, corrected by the delays.
  Eigen::Vector3d undelayed(Eigen::Index i, const Eigen::VectorXd& at) const;
  // A deflection in machine axes, mm: A d (A3), or along the motion by the touch's own gain.
  Eigen::Vector3d reach(Eigen::Index i, const Eigen::Vector3d& deflection, const Eigen::VectorXd& at) const;
  Eigen::Matrix3d deflectionCovariance(Eigen::Index i, const Eigen::VectorXd& at) const;
  // Machine time at which the point is evaluated.
  double pointTime(Eigen::Index i) const;
  Eigen::Vector3d point(Eigen::Index i, const Eigen::VectorXd& at) const;
  // From the centre to a point at the surface of a touch, outwards and beyond the surface.
  Eigen::VectorXd outwards(Eigen::Index i, const Eigen::Vector3d& point, const Eigen::VectorXd& at) const {
    return question_.shape.outwards(arm(point, at), span_.transpose() * touch(i).plan.normal);
  }
  double off_mm(Eigen::Index i, const Eigen::Vector3d& point, const Eigen::VectorXd& at) const {
    return outwards(i, point, at).dot(arm(point, at)) - radius(at) - question_.shape.beyond_mm(touch(i).plan.normal);
  }
  Eigen::VectorXd arm(const Eigen::Vector3d& point, const Eigen::VectorXd& at) const {
    return span_.transpose() * point - at.head(dimensions());
  }
  // Covariance of slope and radial residuals; both contain the velocity, hence the cross term.
  Eigen::Matrix4d covariance(Eigen::Index i, const Eigen::VectorXd& at) const;
  Eigen::MatrixXd carriedOutwards() const;
  bool oneSided(const Eigen::MatrixXd& carried) const;
  // not-reachable: at `later` (s) after some touch's point the joints are where no pose has them.
  std::optional<Refusal> withoutPose(double later) const;
  std::optional<Refusal> dependentDelays() const;

  std::span<const Retract> retracts_;
  const PooledNoise& noise_;
  TouchQuestion question_;
  Eigen::MatrixXd span_;                 // 3 x dimensions
  Eigen::MatrixXd channels_;             // 3 x directions of deflection
  std::vector<Eigen::Matrix4d> factor_;  // lower Cholesky factors: slope (3), radial (1)
};

}  // namespace probebox::metrology
