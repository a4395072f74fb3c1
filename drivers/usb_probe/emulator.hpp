#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "protocol/receiver/packet.hpp"
#include "protocol/units/quantity.hpp"
#include "protocol/units/time.hpp"

namespace probebox::usb_probe {

// Emulates a probe receiver: physical deflections in, packets out, sampled on its own oscillator.
class EmulatedReceiver {
 public:
  struct Config {
    double rate_hz{2000};   // nominal
    double offset_ppm{};    // its period is longer than nominal by this
    double range_um{1000};  // range of the channels
    std::size_t samples_a_packet{16};
    std::uint32_t first_counter{};
    std::size_t counters{};          // axis counters; 0: packets of version 1
    std::uint32_t steps_a_sample{};  // of its counter: packets of version 3, with edges; 0: without
  };
  // Deflection of the channels a, b, c at this time after the start.
  using Waveform = std::function<std::array<Micrometres, 3>(Nanoseconds)>;

  // Counts of the axis counters at this time after the start; the first config.counters of them are sent.
  using Counts = std::function<std::array<std::int64_t, kMostCounters>(Nanoseconds)>;

  EmulatedReceiver(const Config& config, Waveform waveform, MonoTime start, Counts counts = {});

  // Time at which the next packet is complete.
  MonoTime nextPacketAt() const { return takenAt(samples_ + config_.samples_a_packet - 1); }
  // The next packet if it is complete, else empty. Valid until the next call.
  std::span<const std::byte> packet(MonoTime now);

  // Drops the next packets.
  void losePackets(std::size_t packets) { to_lose_ = packets; }
  // Makes an index pulse of this counter at a time between the last packet and the next; at most kMostLatches per
  // packet.
  void pulse(std::uint8_t counter, MonoTime at);
  // Makes an edge of this line at a time between the last packet and the next; at most kMostEdges per packet. Its time
  // is that of the step of the counter before.
  void edge(ReceiverLine line, bool level, MonoTime at);
  // Sets bits of EdgesHeader::faults in the packets that follow.
  void setFaults(std::uint16_t faults) { faults_ = faults; }
  // Makes this counter lose counts from now on.
  void breakWire(std::uint8_t counter) { broken_ = static_cast<std::uint16_t>(broken_ | 1U << counter); }

  // Restarts the receiver, as after a power failure.
  void restart(std::uint32_t counter);

  std::uint64_t samples() const { return samples_; }  // taken
  std::uint64_t sent() const { return sent_; }

 private:
  MonoTime takenAt(std::uint64_t sample) const;
  Sample take(std::uint64_t sample) const;
  // Sample before `at`, and the fraction of a period since then.
  std::pair<std::uint32_t, double> sinceSample(MonoTime at) const;

  Config config_;
  Waveform waveform_;
  MonoTime start_;
  double period_ns_;
  PacketHeader next_;
  std::uint64_t samples_{};
  std::uint64_t sent_{};
  std::size_t to_lose_{};
  Counts counts_;
  std::uint16_t broken_{};
  std::vector<Sample> taken_;
  std::vector<std::int64_t> counted_;  // sample by sample, all counters of each
  std::vector<IndexLatch> latches_;
  std::vector<LineEdge> edges_;
  std::array<std::uint16_t, kReceiverLines> edge_sequence_{};
  std::uint16_t faults_{};
  std::uint8_t levels_{};
  std::vector<std::byte> bytes_;
};

}  // namespace probebox::usb_probe
