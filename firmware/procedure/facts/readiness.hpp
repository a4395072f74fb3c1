#pragma once
#include <cstdint>
#include <optional>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// What reads the balls of a run.
enum class ReadBy : std::uint8_t {
  tip,    // of the stylus
  head,   // a sensor head in its place
  shank,  // the tip of one tool, and its shank as the other length
};

// Why a method cannot be started with these facts, and the remedy; nothing when it can. delay_in_force: a result about
// the system delay is; a sensor head needs none.
std::optional<Error> whyUnready(Method method, const Facts& facts, bool delay_in_force, ReadBy by = ReadBy::tip);
// Why the method cannot be read with a sensor head; nothing when it can.
std::optional<Error> whyNoHead(Method method, const Facts& facts);
// Why no shank can take the place of a second tool; nothing when one can.
std::optional<Error> whyNoShank(Method method, const Facts& facts);
// Why the options ask for balls that the plate does not have; nothing when they do not.
std::optional<Error> whyNoSuchBall(Method method, const ProcedureOptions& options, const Facts& facts);
// The options with what the descriptions say about B and the probe's tools, where the method turns or changes them, and
// about the sensor head or the shank, where it reads.
ProcedureOptions described(Method method, ProcedureOptions options, const Facts& facts, ReadBy by = ReadBy::tip);
// The same about the tool of a run, for a method that measures one.
std::optional<Error> whyUnknownTool(Method method, std::uint32_t tool, const Facts& facts);
// Its result is a place in machine positions, so the axes have to be referenced.
bool findsAPlace(Method method);

}  // namespace probebox::procedure
