#include "drivers/world/world.hpp"

#include <algorithm>

namespace probebox::world {

World::World(const Config& config, std::uint64_t seed)
    : config_{config},
      now_{config.start},
      machine_{config, seed},
      encoders_{config, seed},
      probe_{config, seed},
      sync_{config, seed},
      trigger_{config, seed},
      setter_{config, seed},
      indexes_{config},
      screws_{config, seed} {}

void World::advanceTo(MonoTime now) {
  now_ = std::max(now_, now);
}

void World::follow(const Lead& lead, MonoTime from, MonoTime until) {
  // A nut drifts with its screw while the motor rests; less than this is no move.
  constexpr double kDrift_mm = 1e-5;
  machine_.followTool(lead.tool, from);
  machine_.followMount(lead.mount, from);
  machine_.followPose(lead.pose, from, until);
  const bool commanded = lead.motor_mm != led_to_mm_;
  led_to_mm_ = lead.motor_mm;
  Vector3 nut_mm{};
  for (std::size_t i = 0; i < 3; ++i) nut_mm[i] = screws_.nutPosition_mm(i, lead.motor_mm[i], until);
  if (commanded || norm(nut_mm - machine_.commandedPosition()) > kDrift_mm) machine_.follow(nut_mm, from, until);
}

// Events are computed when they are polled: there is no queue that could overflow.
std::size_t World::poll(std::span<Event> into) {
  std::size_t filled = 0;
  while (filled < into.size()) {
    MonoTime edge_at = MonoTime::max(), trigger_at = MonoTime::max(), index_at = MonoTime::max(),
             setter_at = MonoTime::max();
    if (config_.edges_as_events) {
      sync_.prepare(now_, faults_, ledger_);
      edge_at = sync_.nextAt();
      trigger_at = trigger_.nextAt(machine_);
      setter_at = setter_.nextAt(machine_);
      indexes_.prepare(now_, machine_, screws_);
      index_at = indexes_.nextAt();
    }
    const MonoTime encoders_at = encoders_.nextAt(), probe_at = probe_.nextAt(), drift_at = screws_.nextAt();
    const MonoTime next = std::min({edge_at, trigger_at, setter_at, index_at, encoders_at, probe_at, drift_at});
    if (next > now_) break;
    Event& event = into[filled];
    const bool arrived = next == edge_at       ? sync_.take(event, ledger_)
                         : next == trigger_at  ? trigger_.take(event, machine_, ledger_)
                         : next == setter_at   ? setter_.take(event, machine_, ledger_)
                         : next == index_at    ? indexes_.take(event, ledger_)
                         : next == drift_at    ? screws_.take(event, machine_, faults_, ledger_)
                         : next == encoders_at ? encoders_.take(event, machine_, screws_, faults_, ledger_)
                                               : probe_.take(event, machine_, faults_, ledger_);
    if (arrived) ++filled;
  }
  return filled;
}

std::size_t World::pollEdges(std::span<PhysicalEdge> into) {
  if (config_.edges_as_events) return 0;
  std::size_t filled = 0;
  while (filled < into.size()) {
    sync_.prepare(now_, faults_, ledger_);
    const MonoTime edge_at = sync_.nextAt(), trigger_at = trigger_.nextAt(machine_),
                   setter_at = setter_.nextAt(machine_);
    const MonoTime next = std::min({edge_at, trigger_at, setter_at});
    if (next > now_) break;
    const bool arrived = next == edge_at      ? sync_.take(into[filled], ledger_)
                         : next == trigger_at ? trigger_.take(into[filled], machine_, ledger_)
                                              : setter_.take(into[filled], machine_, ledger_);
    if (arrived) ++filled;
  }
  return filled;
}

Truth World::truth() const {
  const auto table = config_.tilting_table.value_or(board::WorldTiltingTable{});
  const double tau_probe_s = config_.delays.tau_probe_s;
  return Truth{.tau_machine_s = config_.delays.tau_machine_s,
               .tau_probe_s = tau_probe_s,
               .tau_s = config_.delays.tau_machine_s - Vector3{tau_probe_s, tau_probe_s, tau_probe_s},
               .sphere_centre_mm = config_.sphere.centre_mm,
               .effective_radius_mm = config_.sphere.radius_mm + config_.sphere.stylus_ball_radius_mm,
               .part_axis_point_mm = config_.part_spindle.point_mm,
               .part_axis = unit(config_.part_spindle.direction),
               .table_axis_point_mm = table.point_mm,
               .table_axis = unit(table.direction),
               .gain = config_.probe.gain,
               .drift_ppm = sync_.driftPpm(),
               .ledger = ledger_};
}

}  // namespace probebox::world
