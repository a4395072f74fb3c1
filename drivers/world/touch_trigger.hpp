#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/world/config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/random.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// The switch of a touch-trigger probe (TouchTriggerConfig): it opens when the stylus is pushed by its pre-travel,
// closes when it sits again, and may chatter at both.
class TouchTrigger {
 public:
  TouchTrigger(const Config& config, std::uint64_t seed);

  // When the next edge is stamped; the end of time when none is known.
  MonoTime nextAt(const Machine& machine);
  PhysicalEdge take(const Machine& machine);
  // As the kernel hands the edge over that was taken last.
  Event event(const PhysicalEdge& edge) const {
    return Edge{edge.role, edge.line, edge.level, static_cast<std::uint32_t>(taken_), edge.at};
  }

 private:
  static constexpr std::size_t kMostEdges = 8;

  void prepare(const Machine& machine);
  double preTravel(const Contact& contact);
  Nanoseconds lateness();
  void addEdge(MonoTime at);
  void chatter(MonoTime at);

  TouchTriggerConfig trigger_;
  SyncConfig kernel_;
  Random random_;
  std::array<MonoTime, kMostEdges> edges_{};  // levels alternate
  std::size_t next_{}, end_{};
  std::uint64_t contact_{};
  bool pressed_{};  // edges of its begin have been made
  std::uint64_t taken_{};
};

}  // namespace probebox::world
