#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/app/results/result_events.hpp"
#include "firmware/procedure/facts/places.hpp"
#include "firmware/store/record.hpp"
#include "protocol/messages/corrections.hpp"

// Values that procedures use: those of the newest result in force, else those of machine.toml.
namespace probebox::app {

// Values from results in force that replace those of machine.toml in procedures.
struct MeasuredFacts : procedure::MeasuredPlaces {
  std::array<std::optional<procedure::ScrewFace>, kLinearAxes> screw_faces;
  std::optional<procedure::TurningAxis> turning_axis;
  std::vector<procedure::PreTravel> pre_travels;  // of a touch-trigger probe, one a tool
  std::vector<procedure::MeasuredError> machine_errors;
  store::Id machine_check_result{};
};

// A subject, and the result in force about it.
struct InForceAbout {
  std::string subject;
  store::Id id{};
};

// Adds the values of a result in force about the checked ball, the setting device or the pre-travel.
void addFacts(const store::Record& record, MeasuredFacts& facts);

// Lists every such value from descriptions or results, by the name of its subject, with its source.
std::vector<messages::ValueInUse> valuesInUse(const procedure::Facts& described,
                                              std::span<const InForceAbout> in_force);

}  // namespace probebox::app
