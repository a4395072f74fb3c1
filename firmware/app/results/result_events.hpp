#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/facts/places.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "firmware/store/record.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Subjects of results, and the events that activate them.
namespace probebox::app {

// Returns the subject for a name given by a person: a subject or one of its methods.
std::string subjectNamed(std::string_view subject_or_method);

// Events that activate a result: one, plus one per row of a table by angle; none for results that the core does not
// use. Errors name a missing or non-finite value, or a table that is too long.
Outcome<std::vector<Event>> activationOf(const store::Record& record, MonoTime now);

// Reads the calibration of a sensor head from its result about that. Errors name what is missing.
Outcome<procedure::CalibratedHead> calibratedHeadOf(const store::Record& record);

// nullopt for results about anything else.
std::optional<procedure::MeasuredLength> measuredLengthOf(const store::Record& record);
// Tip of a tool from its tool-setter result; nullopt for results about anything else.
std::optional<procedure::MeasuredTip> measuredTipOf(const store::Record& record);

// Reads the pre-travel of a touch-trigger probe from its result. Errors name what is missing.
Outcome<procedure::PreTravel> preTravelOf(const store::Record& record);

// Event that deactivates a subject.
std::optional<Event> noneInForce(std::string_view name, MonoTime now);

}  // namespace probebox::app
