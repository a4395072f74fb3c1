#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/world/config.hpp"
#include "drivers/world/contact_lines.hpp"
#include "drivers/world/encoders.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/index_lines.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/probe.hpp"
#include "drivers/world/screws.hpp"
#include "drivers/world/sync_line.hpp"
#include "drivers/world/truth.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

// Emulates the machine tool on virtual time: three axes with encoders, a master clock, a scanning probe, a datum
// sphere. The same config, seed and commands give the same bytes, independent of the steps of time and of polling.
namespace probebox::world {

// Command of an external control for one of its cycles: the encoder positions that X, Y and Z reach at its end, the
// angles of the rotary axes, the tool in the spindle, and the mount that the balls of the part are in.
struct Lead {
  Vector3 motor_mm{};
  Pose pose{};
  std::uint32_t tool{};
  std::size_t mount{1};
  friend bool operator==(const Lead&, const Lead&) = default;
};

class World {
 public:
  World(const Config& config, std::uint64_t seed);

  // Advances to `now`, never backwards. Poll the events up to `now` before the machine has made another
  // MotionHistory::kRemembered moves.
  void advanceTo(MonoTime now);
  MonoTime now() const { return now_; }

  // Moves events into `into` and returns their number; 0 when all have been delivered. Stamps never decrease.
  std::size_t poll(std::span<Event> into);

  // Moves the edges of the lines alone, when the config asks for physical edges: `at` is the stamp of the kernel,
  // including its delay; `lost` marks an edge for which the kernel has no room.
  std::size_t pollEdges(std::span<PhysicalEdge> into);

  // Does what a control outside commands in one of its cycles. Nuts stand where warm screws put them.
  void follow(const Lead& lead, MonoTime from, MonoTime until);

  // Returns the machine, which the emulated controller commands; it uses nothing else of the world.
  Machine& machine() { return machine_; }

  // Adds a fault; false when the schedule is full. A fault in the past begins with the events not delivered yet.
  bool inject(const Fault& fault) { return faults_.add(fault); }
  // The encoder of this linear axis was without power: it counts from 0 where the axis stands.
  void restartEncoder(std::size_t axis) { encoders_.restart(axis); }

  // For tests and the demo.
  Truth truth() const;
  const Machine& machine() const { return machine_; }
  const Screws& screws() const { return screws_; }
  // Returns one of the latest SyncLine::kRemembered ticks; nothing for others.
  std::optional<TrueTick> trueTick(Tick tick) const { return sync_.trueTick(tick); }
  std::optional<TrueEdge> trueEdge(std::uint32_t line_sequence) const { return sync_.trueEdge(line_sequence); }

 private:
  Config config_;
  MonoTime now_{};
  Vector3 led_to_mm_{};
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
