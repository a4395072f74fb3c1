#include "drivers/usb_probe/emulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace probebox::usb_probe {

EmulatedReceiver::EmulatedReceiver(const Config& config, Waveform waveform, MonoTime start, Counts counts)
    : config_{config},
      waveform_{std::move(waveform)},
      start_{start},
      period_ns_{1e9 / config.rate_hz * (1 + config.offset_ppm * 1e-6)},
      counts_{std::move(counts)},
      taken_(config.samples_a_packet),
      counted_(config.samples_a_packet * config.counters),
      bytes_(packetBytes(config.samples_a_packet, config.counters, kMostLatches, kMostEdges)) {
  next_.first = config.first_counter;
}

MonoTime EmulatedReceiver::takenAt(std::uint64_t sample) const {
  return start_ + Nanoseconds{std::llround(static_cast<double>(sample) * period_ns_)};
}

std::span<const std::byte> EmulatedReceiver::packet(MonoTime now) {
  while (nextPacketAt() <= now) {
    for (std::size_t i = 0; i < taken_.size(); ++i, ++samples_) {
      taken_[i] = take(samples_);
      if (config_.counters > 0)
        std::ranges::copy_n(counts_(takenAt(samples_) - start_).begin(), static_cast<std::ptrdiff_t>(config_.counters),
                            counted_.begin() + static_cast<std::ptrdiff_t>(i * config_.counters));
    }
    const Counters counters{config_.counters, counted_, latches_};
    const Edges edges{config_.steps_a_sample, faults_, edges_, levels_};
    const std::size_t size = config_.steps_a_sample > 0 ? encodePacket(next_, taken_, counters, bytes_, &edges)
                             : config_.counters > 0     ? encodePacket(next_, taken_, counters, bytes_)
                                                        : encodePacket(next_, taken_, bytes_);
    latches_.clear();
    edges_.clear();
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
  made.status = static_cast<std::uint16_t>(broken_ << status::kFirstCounterFault);
  for (std::size_t i = 0; i < deflection.size(); ++i) {
    const double um = std::clamp(deflection[i].value(), -config_.range_um, config_.range_um);
    if (um != deflection[i].value()) made.status |= status::kClipped;
    made.channels_nm[i] = static_cast<std::int32_t>(std::lround(1e3 * um));
  }
  return made;
}

std::pair<std::uint32_t, double> EmulatedReceiver::sinceSample(MonoTime at) const {
  const double since = static_cast<double>((at - start_).count()) / period_ns_;
  const double before = std::floor(since);
  const auto ahead = static_cast<std::int64_t>(before) - static_cast<std::int64_t>(samples_);
  return {next_.first + static_cast<std::uint32_t>(ahead), since - before};
}

void EmulatedReceiver::pulse(std::uint8_t counter, MonoTime at) {
  const auto [sample, fraction] = sinceSample(at);
  latches_.push_back({.sample = sample,
                      .fraction = static_cast<std::uint32_t>(std::ldexp(fraction, 32)),
                      .counter = counter,
                      .counts = counts_(at - start_).at(counter)});
}

void EmulatedReceiver::edge(ReceiverLine line, bool level, MonoTime at) {
  const auto [sample, fraction] = sinceSample(at);
  const auto bit = 1U << static_cast<unsigned>(line);
  levels_ = static_cast<std::uint8_t>(level ? levels_ | bit : levels_ & ~bit);
  const double steps = config_.steps_a_sample;
  edges_.push_back({.sample = sample,
                    .fraction = static_cast<std::uint32_t>(std::ldexp(std::floor(fraction * steps) / steps, 32)),
                    .line = static_cast<std::uint8_t>(line),
                    .level = static_cast<std::uint8_t>(level ? 1 : 0),
                    .sequence = ++edge_sequence_.at(static_cast<std::size_t>(line))});
}

void EmulatedReceiver::restart(std::uint32_t counter) {
  next_.first = counter;
  ++next_.run;
}

}  // namespace probebox::usb_probe
