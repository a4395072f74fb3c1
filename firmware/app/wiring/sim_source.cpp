#include "firmware/app/wiring/sim_source.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "drivers/world/from_description.hpp"

namespace probebox::app {
namespace {

// A controller's servo cycle.
constexpr Nanoseconds kCycle = std::chrono::milliseconds{1};

world::Config startingAt(world::Config config, MonoTime start) {
  config.start = start;
  return config;
}

}  // namespace

Outcome<std::unique_ptr<SimSource>> SimSource::open(const board::World& world, const board::Machine& machine,
                                                    std::unique_ptr<world::BoxLink> link, MonoTime start) {
  auto source = std::make_unique<SimSource>(world, machine, std::move(link), start);
  if (world.outside_control) {
    TRY(auto control, OutsideControl::open(world, source->world_));
    source->outside_control_ = std::move(control);
  }
  return source;
}

SimSource::SimSource(const board::World& world, const board::Machine& machine, std::unique_ptr<world::BoxLink> link,
                     MonoTime start)
    : world_{startingAt(world::fromDescription(world, machine), start), world.seed},
      link_{std::move(link)},
      controller_{world::controllerFromDescription(world), world_.machine(), *link_},
      reached_{start} {
  for (const auto& fault : world::faultsFromDescription(world, start)) world_.inject(fault);
}

std::size_t SimSource::read(std::span<Event> into, MonoTime now) {
  advanceTo(now);
  return world_.poll(into);
}

void SimSource::advanceTo(MonoTime now) {
  if (outside_control_) {
    outside_control_->serve(now);
    return world_.advanceTo(outside_control_->known(now));
  }
  while (reached_ < now) {
    reached_ = std::min(reached_ + kCycle, now);
    controller_.advance(reached_);
    world_.advanceTo(reached_);
  }
}

}  // namespace probebox::app
