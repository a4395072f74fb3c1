#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/whole_touch.hpp"
#include "protocol/units/outcome.hpp"

// The touches of a machine check, as its fit takes them.
namespace probebox::metrology {

// Unknowns of a touch beside the place of its direction.
inline constexpr Eigen::Index kDelays = 3, kLost = 3, kLostAt = kDelays, kHysteresisAt = kLostAt + kLost,
                              kBendAt = kHysteresisAt + 1, kOthers = kBendAt + 3;

struct CheckTouch {
  WholeTouch touch;
  std::size_t recorded{};  // place among the recorded touches
  Eigen::Index direction{};
  Eigen::Vector3d normal{};
  double distance_mm{};  // from the first guess of the centre
  double minutes{};      // since the middle of the run
  double speed_mm_s{};   // mean of both ways
  double depth_mm{};     // of the deflection

  // Covariance of distance, delay and bend; a touch whose way in is of no use tells no delay of its own.
  Eigen::Matrix3d covariance() const {
    constexpr std::array<Eigen::Index, 3> kOrder{1, 0, 3};
    Eigen::Matrix3d chosen = touch.covariance(kOrder, kOrder);
    const double seen = normal.dot(touch.plan.retract);
    chosen(0, 0) += std::max(0.0, 1.0 - seen * seen) * touch.across_variance;
    if (touch.has_way_in) return chosen;
    chosen.row(1).setZero();
    chosen.col(1).setZero();
    chosen(1, 1) = 1;
    return chosen;
  }
};

struct CheckRun {
  std::vector<Touch> recorded;
  std::vector<CheckTouch> touches;
  std::vector<Eigen::Vector3d> directions;
  Eigen::Vector3d about = Eigen::Vector3d::Zero();  // first guess of the centre
  double half_min{};                                // half of the run
  bool curved{};                                    // the repeats tell a drift that changes
  std::size_t noise_dof{};
  std::vector<std::string> warnings;
  std::vector<Dropped> dropped;

  Eigen::Index count() const { return std::ssize(touches); }
  Eigen::Index driftAt() const { return std::ssize(directions); }
  Eigen::Index othersAt() const { return driftAt() + (curved ? 6 : 3); }
  Eigen::Index unknowns() const { return othersAt() + kOthers; }
};

// Refuses: what readTouches and fitWholeRecord refuse, single-speed, speeds-too-close, few-directions, not-closed.
Outcome<CheckRun, Refusal> readCheckRun(const Dataset& dataset);

}  // namespace probebox::metrology
