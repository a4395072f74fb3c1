#pragma once
#include <cstdint>
#include <optional>

#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"
#include "protocol/step/step.hpp"

// Connects the emulated controller to a box by its public interfaces, over a link that answers late or never.
namespace probebox::world {

using probebox::BMoves;
using probebox::RunState;
using probebox::StepFeature;
using probebox::StepKind;

// Describes the step that the box asks the machine to do. run_out_mm 0: not stated; approach_direction zeros: against
// the retract.
struct Prompt : Step {
  std::uint32_t run{};
  RunState state{};
  std::uint32_t step{};
  bool referenced{true};  // the box knows where all axes stand
};

// Neither call waits. An implementation sends a request over TCP or writes registers, and keeps the answer.
class BoxLink {
 public:
  virtual ~BoxLink() = default;

  // Sends a marker. Repeat it when no answer comes: the box counts it once.
  virtual void postMarker(const Marker& marker) = 0;
  // Returns the answer to the last marker: true when accepted, false when refused (another run or step, not allowed).
  // Nothing until an answer has come. The answer stays until the next post.
  virtual std::optional<bool> markerAnswer() = 0;

  // Reports the machine position of the homed axes to the box. There is no answer; the status shows the effect.
  // Does not wait.
  virtual void home(const Vector3& position_mm) = 0;

  // Requests the status of the procedure.
  virtual void askProcedureStatus() = 0;
  // Returns the answer to the last request, nothing until it has come. Never returns the answer to an earlier request:
  // it may be older than a marker.
  virtual std::optional<Prompt> procedureStatus() = 0;
};

}  // namespace probebox::world
