#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/finished_run.hpp"
#include "protocol/units/outcome.hpp"

// Touches of a touch-trigger probe, and its pre-travel.
namespace probebox::procedure {

// True if the touches of the run were read by the switch of a touch-trigger probe.
bool readsBySwitch(const FinishedRun& run);

// Those in force of the tools whose stylus balls were read, by the number that their touches name; touches of a shank
// need none. Refuses: no-pre-travel.
Outcome<std::vector<PreTravel>, metrology::Refusal> preTravelsOf(const FinishedRun& run);

// Names them in the case: pre_travel_result, or by tool as metrology::key::kPreTravelResults.
void addPreTravelResults(metrology::Dataset& dataset, const std::vector<PreTravel>& pre_travels);

// Corrects the touches with the stylus ball of a tool to the surface: each is moved out along its normal by the
// pre-travel in its direction, in the probe's own axes, which turn with A and with a swivelling head. parts_mm: in the
// order of metrology::preTravelParts().
std::vector<metrology::SwitchedTouch> withoutPreTravel(std::vector<metrology::SwitchedTouch> touches,
                                                       const FinishedRun& run, std::uint32_t tool,
                                                       const Eigen::Vector4d& parts_mm);

// Uncorrelated causes of the pre-travel's uncertainty, mm: column k is the change of the parts by one sd of cause k.
Eigen::Matrix4d causesOf(const PreTravel& pre_travel);

// Adds the changes of the method's tables by a cause (metrology/dataset/pre_travel_shifts.hpp, stop_shifts.hpp), if it
// changes them. shifted: the tables computed with that cause off by one sd. suffix: of the names of the tables.
void addShifts(metrology::Dataset& dataset, const metrology::Dataset& shifted, std::string_view suffix);

}  // namespace probebox::procedure
