#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-joints": system delay tau = tau_machine - tau_probe (A1) of a machine whose axes are not Cartesian,
// from touches of a sphere (CN101622513, docs/metrology.md A.6c, (A21)). Tables probe and touches as of every touch
// method; machine{touch,t_s,q1_rad,q2_mm,..}: joint positions; config tip_mm and chain as JointChain::read has them,
// or legs as ParallelKinematics::read.
// Config: delays (common, each-joint), effective_diameter_mm (free without it), feature, previous_tau_s or
// previous_tau_joint_s. Gives tau_s or tau_joint_s, centre_mm in the frame of the machine's base; also gain_matrix.
// Refuses what those and TouchDelay::measure refuse; bad-config, joint-not-moved, not-reachable.
Outcome<Result, Refusal> solveDelayJoints(const Dataset& dataset);

extern const Method kDelayJoints;

}  // namespace probebox::metrology
