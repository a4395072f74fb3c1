#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Touches of a touch-trigger probe, and its pre-travel.
namespace probebox::procedure {

// Whether the touches of the run were read by the switch of a touch-trigger probe.
bool readsBySwitch(const FinishedRun& run);

// The touches at the surface: each moved out along its normal by the pre-travel of its direction in the probe's own
// axes, which turn with A and with a head that swivels. parts_mm: as metrology::preTravelParts() weighs them.
std::vector<metrology::SwitchedTouch> withoutPreTravel(std::vector<metrology::SwitchedTouch> touches,
                                                       const FinishedRun& run, const Eigen::Vector4d& parts_mm);

// Uncorrelated causes of the pre-travel's uncertainty: a column each, what one sd of it changes the parts by.
Eigen::Matrix4d causesOf(const PreTravel& pre_travel);

// Adds what a cause changes the method's tables by (metrology/dataset/pre_travel_shifts.hpp), where it changes them.
// shifted: the tables with that cause off by one sd.
void addShifts(metrology::Dataset& dataset, const metrology::Dataset& shifted, std::size_t cause);

}  // namespace probebox::procedure
