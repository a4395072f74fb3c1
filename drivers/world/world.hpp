#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/world/config.hpp"
#include "drivers/world/encoders.hpp"
#include "drivers/world/fault.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/index_lines.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/probe.hpp"
#include "drivers/world/screws.hpp"
#include "drivers/world/setter_line.hpp"
#include "drivers/world/sync_line.hpp"
#include "drivers/world/trigger_line.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

// The emulated machine tool: three axes with encoders, a master clock, a scanning probe and a datum sphere, on virtual
// time. The same config, seed and commands give the same bytes, however finely time is advanced and events are polled.
namespace probebox::world {

class World {
 public:
  World(const Config& config, std::uint64_t seed);

  // Time is given, never read. What has happened until `now` can be polled from then on, and should be before the
  // machine has made another MotionHistory::kRemembered moves. Time never goes back.
  void advanceTo(MonoTime now);
  MonoTime now() const { return now_; }

  // Moves what has happened into `into` and says how much; 0 when all has been handed out. Stamps never go back.
  std::size_t poll(std::span<Event> into);

  // The same for the edges of the lines alone, when the config asks for physical edges: `at` is when the kernel stamps
  // the edge, late as kernels are, and `lost` says that the kernel has no room for it.
  std::size_t pollEdges(std::span<PhysicalEdge> into);

  // What a controller commands. The emulated controller uses nothing else of the world.
  Machine& machine() { return machine_; }

  // False when no more faults can be remembered. A fault in the past begins with what has not been handed out yet.
  bool inject(const Fault& fault) { return faults_.add(fault); }

  // For tests and the demo.
  Truth truth() const;
  const Machine& machine() const { return machine_; }
  const Screws& screws() const { return screws_; }
  // One of the latest SyncLine::kRemembered ticks; nothing for others.
  std::optional<TrueTick> trueTick(Tick tick) const { return sync_.trueTick(tick); }
  std::optional<TrueEdge> trueEdge(std::uint32_t line_sequence) const { return sync_.trueEdge(line_sequence); }

 private:
  Config config_;
  MonoTime now_{};
  Ledger ledger_;
  FaultSchedule faults_;
  Machine machine_;
  Encoders encoders_;
  Probe probe_;
  SyncLine sync_;
  TriggerLine trigger_;
  SetterLine setter_;
  IndexLines indexes_;
  Screws screws_;
};

}  // namespace probebox::world
