#include "drivers/world/encoders.hpp"

#include <cmath>

namespace probebox::world {
namespace {

constexpr std::uint64_t kStream = 1;

}  // namespace

Encoders::Encoders(const Config& config, std::uint64_t seed)
    : config_{config.encoders},
      tau_s_{config.delays.tau_machine_s},
      random_{seed, kStream},
      sampling_{config.start, config.encoders.rate_hz, random_} {}

bool Encoders::take(Event& event, const Machine& machine, const Screws& screws, const FaultSchedule& faults,
                    Ledger& ledger) {
  const MonoTime at = nextAt();
  if (!faults.active(FaultKind::stick_encoders, at)) {
    position_mm_[axis_] = screws.motorPosition_mm(axis_, machine.positionAt(at, tau_s_[axis_])[axis_], at);
  }
  const double position_mm =
      position_mm_[axis_] + config_.power_up_mm[axis_] + 1e-3 * config_.noise_um * random_.normal();
  const bool dropped = random_.happens(config_.dropout_probability) || faults.active(FaultKind::drop_encoders, at);
  event = Count{.axis = static_cast<Axis>(axis_),
                .sequence = static_cast<std::uint32_t>(latch_),
                .counts = config_.sense[axis_] * std::llround(position_mm * config_.counts_per_mm),
                .at = at};
  ++ledger.encoder_latches;
  if (dropped) ++ledger.dropped_encoders;
  if (++axis_ == kLinearAxes) axis_ = 0, ++latch_;
  return !dropped;
}

}  // namespace probebox::world
