#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/store/record.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// What a result is about, and what the core must hear of it.
namespace probebox::app {

// The question that a method answers: "delay" for every delay-* method, "centreline" for all that give the turning
// axis, "screw-x", "screw-y", "screw-z" by the dataset's axis, "rotary-c" and so on likewise, "swivel-b" and so on by
// the direction of its swivel_axis, "tool-4", "assembly-4" and "sensor-head-5" by the tool's number; otherwise the
// method's own name.
std::string subjectOf(const metrology::Dataset& dataset);

// What a person may call a subject: itself, or a method that answers it.
std::string subjectNamed(std::string_view subject_or_method);

// The events that bring a result into force, one or, with a table by angle, one and a row each; none for results that
// the core does not use. An error says what of it the core cannot use: a value that is missing or not finite, a table
// that is too long.
Outcome<std::vector<Event>> activationOf(const store::Record& record, MonoTime now);

// The tool number of the sensor head that a subject is about ("sensor-head-5"); nothing for other subjects.
std::optional<std::uint32_t> sensorHeadOf(std::string_view subject);

// What a result about a sensor head says of it, or what of it cannot be used.
Outcome<procedure::CalibratedHead> calibratedHeadOf(const store::Record& record);

// The axis whose errors a subject is about ("rotary-c"); nothing for other subjects.
std::optional<RotaryAxis> rotaryAxisOf(std::string_view subject);

// The event that says: no result about this is in force any more.
std::optional<Event> noneInForce(std::string_view subject, MonoTime now);

}  // namespace probebox::app
