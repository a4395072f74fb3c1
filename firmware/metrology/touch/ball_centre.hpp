#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One ball reading: the machine position at which the stylus ball would be centred on the ball.
struct BallCentre {
  Eigen::Vector3d centre_mm;
  Eigen::Vector3d sd_mm;  // k = 1
  double radius_mm{};     // effective: ball and stylus ball
};

// A touch without a reading: the machine position at contact.
struct LoneTouch {
  std::size_t touch{};  // row of touches
  Eigen::Vector3d at_mm;
  double sd_mm{};                                           // k = 1, along the motion
  Eigen::Vector3d velocity_mm_s = Eigen::Vector3d::Zero();  // on the way out; zero of one by edges
};
inline constexpr std::size_t kAlone = static_cast<std::size_t>(-1);

struct BallCentres {
  std::vector<BallCentre> readings;  // in the order of their numbers
  std::vector<LoneTouch> alone;      // in the order of the touches
  double chi2_reduced{};             // of the touches against their spheres, all readings together
  std::size_t dof{};
  std::vector<Dropped> dropped;  // touches dropped because of their own data
};

// Where the touches of a reading are: around the ball, or on a lathe of X and Z in one plane across Y.
enum class Plane : std::uint8_t { none, xz };

// Computes the centre of the touched ball for each reading, corrected by the system delay: P = M + T v (A2), then a
// sphere with free radius (B.0); with Plane::xz the circle in that plane, with Y where the touches were and no sd of
// it. Tables machine, probe, touches; reading_of_touch: one per touch, from 0 without gaps,
// or kAlone. tau_s: X Y Z. A common delay error changes the radius, not the centre. sd: from the pooled residuals of
// the samples (A8), widened when the touches scatter more. Refuses what readTouches, fitRetract and fitSphere refuse,
// naming the reading.
Outcome<BallCentres, Refusal> ballCentres(const Dataset& touches, const std::vector<std::size_t>& reading_of_touch,
                                          const std::array<double, 3>& tau_s, Plane plane = Plane::none);

}  // namespace probebox::metrology
