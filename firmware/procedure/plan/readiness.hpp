#pragma once
#include <cstdint>
#include <optional>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Means by which the balls of a run are measured.
enum class ReadBy : std::uint8_t {
  tip,    // of the stylus
  head,   // a sensor head instead of the probe
  shank,  // the tip of one tool, and its shank as the second length
};

ReadBy readBy(const ProcedureOptions& asked);

// Whether a touch-trigger probe makes the run: not at all, as it is, or with the pre-travel in force of each tool whose
// stylus ball reads.
enum class ByTrigger : std::uint8_t { refused, as_it_is, with_pre_travel };
ByTrigger byTrigger(const LiveMethod& method, ReadBy by);

// Completes the options of a run from the descriptions, or explains why it cannot be started as requested:
// options without effect, a sensor head, shank, ball or tool that is not described, no room for a sweep.
Outcome<ProcedureOptions, NotReady> readied(const LiveMethod& method, const ProcedureOptions& asked, const Facts& facts,
                                            const MachineNow& now);

// Explains why a method cannot be started with these facts, with the remedy; nullopt when it can. delay_in_force: a
// system delay is in force; a sensor head needs none, and a touch-trigger probe needs its pre-travel instead.
std::optional<NotReady> whyUnready(const LiveMethod& method, const Facts& facts, bool delay_in_force,
                                   ReadBy by = ReadBy::tip);
// Explains why a machine without Y cannot make the run; nullopt when it can.
std::optional<NotReady> whyNoY(const LiveMethod& method, const ProcedureOptions& asked, const Facts& facts);
// Explains why the method cannot use a sensor head; nullopt when it can.
std::optional<NotReady> whyNoHead(const LiveMethod& method, const Facts& facts);
// Explains why a shank cannot replace a second tool; nullopt when it can.
std::optional<NotReady> whyNoShank(const LiveMethod& method, const Facts& facts);
// Completes the options from the descriptions: angles of B and the probe's tools where the method uses them, travel and
// speed of a sweep, sensor head or shank if chosen.
Outcome<ProcedureOptions> described(const LiveMethod& method, const ProcedureOptions& options, const Facts& facts,
                                    ReadBy by = ReadBy::tip);

}  // namespace probebox::procedure
