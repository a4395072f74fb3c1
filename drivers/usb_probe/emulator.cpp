#include "drivers/usb_probe/emulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace probebox::usb_probe {

EmulatedReceiver::EmulatedReceiver(const Config& config, Waveform waveform, MonoTime start)
    : config_{config},
      waveform_{std::move(waveform)},
      start_{start},
      period_ns_{1e9 / config.rate_hz * (1 + config.offset_ppm * 1e-6)},
      taken_(config.samples_a_packet),
      bytes_(packetBytes(config.samples_a_packet)) {
  next_.first = config.first_counter;
}

MonoTime EmulatedReceiver::takenAt(std::uint64_t sample) const {
  return start_ + Nanoseconds{std::llround(static_cast<double>(sample) * period_ns_)};
}

std::span<const std::byte> EmulatedReceiver::packet(MonoTime now) {
  while (nextPacketAt() <= now) {
    for (auto& sample : taken_) sample = take(samples_++);
    const std::size_t size = encodePacket(next_, taken_, bytes_);
    next_.first += static_cast<std::uint32_t>(taken_.size());
    if (to_lose_ > 0) {
      --to_lose_;
      continue;
    }
    sent_ += taken_.size();
    return std::span{bytes_}.first(size);
  }
  return {};
}

Sample EmulatedReceiver::take(std::uint64_t sample) const {
  const auto deflection = waveform_(takenAt(sample) - start_);
  Sample made;
  for (std::size_t i = 0; i < deflection.size(); ++i) {
    const double um = std::clamp(deflection[i].value(), -config_.range_um, config_.range_um);
    if (um != deflection[i].value()) made.status |= status::kClipped;
    made.channels_nm[i] = static_cast<std::int32_t>(std::lround(1e3 * um));
  }
  return made;
}

void EmulatedReceiver::restart(std::uint32_t counter) {
  next_.first = counter;
  ++next_.run;
}

}  // namespace probebox::usb_probe
