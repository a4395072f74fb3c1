#pragma once
#include <cstdint>
#include <optional>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// What measures the balls of a run.
enum class ReadBy : std::uint8_t {
  tip,    // of the stylus
  head,   // a sensor head in its place
  shank,  // the tip of one tool, and its shank as the second length
};

// Explains why a method cannot be started with these facts, with the remedy; nullopt when it can. delay_in_force: a
// system delay is in force; a sensor head needs none.
std::optional<Error> whyUnready(Method method, const Facts& facts, bool delay_in_force, ReadBy by = ReadBy::tip);
// Explains why the method cannot use a sensor head; nullopt when it can.
std::optional<Error> whyNoHead(Method method, const Facts& facts);
// Explains why a shank cannot replace a second tool; nullopt when it can.
std::optional<Error> whyNoShank(Method method, const Facts& facts);
// Explains which requested balls the plate does not have; nullopt when it has all.
std::optional<Error> whyNoSuchBall(Method method, const ProcedureOptions& options, const Facts& facts);
// Completes the options from the descriptions: angles of B and the probe's tools where the method uses them, sensor
// head or shank if chosen.
ProcedureOptions described(Method method, ProcedureOptions options, const Facts& facts, ReadBy by = ReadBy::tip);
// Explains why a tool cannot be measured: it is not described. nullopt for methods that measure no tool.
std::optional<Error> whyUnknownTool(Method method, std::uint32_t tool, const Facts& facts);
// Tests whether the result is a machine position, so the axes must be referenced.
bool findsAPlace(Method method);

}  // namespace probebox::procedure
