#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/plan/finished_run.hpp"
#include "protocol/units/outcome.hpp"

// Contacts of the ball on the rim with the standing stylus, by turns of C.
namespace probebox::procedure {

struct RimContacts {
  double clockwise_rad{}, anticlockwise_rad{};  // C1 and C2 of (B25): clockwise from [rim_ball] c_deg
  double sd_rad{};                              // k = 1, of one of them
  std::uint32_t tool{};
  Eigen::Vector3d stylus_mm;  // machine position, between the two
  // Change of each angle if the stylus is 1 mm further along X and Y, rad/mm.
  Eigen::RowVector2d clockwise_per_mm, anticlockwise_per_mm;
};

// Angles of C at which ball and stylus just touch, of the run's two turns. Free of all delays: each is the mean of the
// way there and the way back at the same speed. A switch: the mean of both edges, without the pre-travel in force. A
// scanning probe: lines of deflection over the angle of C, extrapolated to zero. Heights of the stylus that differ are
// taken out. Refuses: missing-contact, wrong-side, unequal-heights, too-few-samples, no-pre-travel.
Outcome<RimContacts, metrology::Refusal> rimContacts(const FinishedRun& run);

}  // namespace probebox::procedure
