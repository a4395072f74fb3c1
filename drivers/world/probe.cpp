#include "drivers/world/probe.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {
Probe::Probe(const Config& config, std::uint64_t seed)
    : config_{config.probe},
      distance_{config.distance_probe},
      zero_{config, Vibrates::probe, config.probe.drift},
      samples_{!config.touch_trigger},
      tau_s_{config.delays.tau_probe_s},
      channels_of_displacement_{inverse(config.probe.gain)},
      random_{seed, RandomStream::probe},
      sampling_{config.start, config.probe.rate_hz, random_} {}

// Springs with friction rest until the stylus is half of the hysteresis away from what they show.
Vector3 Probe::channels(const Vector3& displacement_mm, MonoTime at) {
  const Vector3 behind = displacement_mm - felt_;
  const double drag_mm = config_.hysteresis_mm / 2;
  if (norm(behind) > drag_mm) felt_ = displacement_mm - drag_mm * unit(behind);
  Vector3 channels_mm = channels_of_displacement_ * (felt_ + zero_.at(at, tau_s_));
  for (double& channel_mm : channels_mm) channel_mm *= 1 + config_.curvature * std::abs(channel_mm) / config_.range_mm;
  return channels_mm;
}

bool Probe::take(Event& event, const Machine& machine, const FaultSchedule& faults, Ledger& ledger) {
  Deflection deflection{
      .sequence = static_cast<std::uint32_t>(sample_), .channels_nm = {}, .clipped = false, .at = nextAt()};
  const auto head = machine.headReadingAt(deflection.at, tau_s_);
  const bool by_distance = distance_ && !head;
  Vector3 channels_mm{}, middle_mm{};
  double range_mm = config_.range_mm;
  if (head) {
    channels_mm = head->sensors_mm;
    range_mm = head->range_mm;
  } else if (by_distance) {
    middle_mm[0] = distance_->stand_off_mm;
    channels_mm[0] = machine.distanceAt(deflection.at, tau_s_, middle_mm[0]);
    range_mm = distance_->range_mm;
  } else {
    channels_mm = channels(machine.probeDisplacementAt(deflection.at, tau_s_), deflection.at);
  }
  for (std::size_t i = 0; i < (by_distance ? 1 : channels_mm.size()); ++i) {
    const double noise_um =
        (head ? head->noise_um : config_.noise_um) * (faults.active(FaultKind::probe_noisy, deflection.at) ? 100 : 1);
    const double read_mm = channels_mm[i] + 1e-3 * noise_um * random_.normal();
    const double clipped_mm = std::clamp(read_mm, middle_mm[i] - range_mm, middle_mm[i] + range_mm);
    deflection.clipped |= clipped_mm != read_mm;
    deflection.channels_nm[i] = static_cast<std::int32_t>(std::lround(1e6 * clipped_mm));
  }
  if (faults.active(FaultKind::probe_frozen, deflection.at)) {
    deflection.channels_nm = last_nm_;
  } else {
    last_nm_ = deflection.channels_nm;
  }
  const bool dropped =
      random_.happens(config_.dropout_probability) || faults.active(FaultKind::probe_silent, deflection.at);
  event = deflection;
  ++sample_;
  ++ledger.probe_samples;
  if (dropped) ++ledger.dropped_probe;
  return !dropped;
}

}  // namespace probebox::world
