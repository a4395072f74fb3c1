#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/touched_shape.hpp"
#include "firmware/metrology/touch/whole_touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// All touches of a run on their whole records (CN101622513, docs/metrology.md A.3b). Each tells where it met the
// surface, from both ways, and by how much its ways differ: with lost motion l of the axes, which lag behind their
// encoders by half of it, a touch at speed S along u has
//   way in - way out = 2 S sum_j c_j tau_j - sum_a |u_a| l_a,   |p - centre| = radius.
// The size is fitted; the delay does not depend on it. Two speeds part the delay from the lost motion; at one speed
// the lost motion counts as what is known of it, and the delay is too small by the rest of it over 2 S.

// What a delay moves each touch by, along its retract, in units of its speed: one row a touch, one column a delay; one
// delay for all axes has ones, one per axis the squares of the direction.
struct WholeRecordQuestion {
  Eigen::MatrixXd carried;
  double lost_mm{};  // known lost motion of every axis, where one speed does not tell it
  TouchedShape shape{};
};

struct WholeRecord {
  Eigen::VectorXd tau_s;
  Eigen::VectorXd lost_mm;  // of x, y and z; of all axes together; or empty at one speed
  Eigen::VectorXd centre;   // mm, in the span of the normals: three numbers for a sphere
  double size_mm{};         // effective
  double bend_per_mm{};     // of the probe's gain, relative; root mean square where touches differ
  // Of tau_s, lost_mm, centre, size_mm and bend_per_mm, in this order, from the readings' noise.
  Eigen::MatrixXd covariance;
  // Change of the same, a row each, when one touch, a column each, lies 1 mm further along its normal.
  Eigen::MatrixXd per_shift;
  double chi2_reduced{};  // of what the touches tell, against that noise
  std::size_t chi2_dof{};
  std::size_t noise_dof{};    // of the residuals of the stream with fewer
  Eigen::VectorXd off_mm;     // one per touch: |p - centre| - radius; 0 where it was not read
  std::vector<double> worst;  // one per touch: largest deviation, in sd; infinite where it was not read
  double condition{};
  std::vector<WholeTouch> touches;  // that were read
  std::vector<std::string> warnings;

  Eigen::Index lostAt() const { return tau_s.size(); }
  Eigen::Index centreAt() const { return lostAt() + lost_mm.size(); }
  Eigen::Index sizeAt() const { return centreAt() + centre.size(); }
};

// Refuses: too-few-readings, way-in-missing (no touch whose way in and way out can both be used), and what
// TouchRecord and leastSquares refuse.
Outcome<WholeRecord, Refusal> fitWholeRecord(std::span<const Touch> touches, const WholeRecordQuestion& question);

}  // namespace probebox::metrology
