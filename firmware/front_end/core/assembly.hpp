#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/receiver/front_end.hpp"

// From what the hardware latched to packets. Pure: no register, no clock, no allocation.
namespace probebox::front_end {

// A stamp of the hardware: 27 bits of a counter that counts steps down from 0, then the levels of five pins.
inline constexpr unsigned kStampedPins = 5;

// Bits that stay set until the host has taken a packet with them.
template <std::size_t N>
class UntilTaken {
 public:
  void raise(std::size_t bit, std::uint32_t packet) {
    bits_ = static_cast<std::uint16_t>(bits_ | 1U << bit);
    last_[bit] = packet;
  }
  // `packet` has reached the host.
  void taken(std::uint32_t packet) {
    for (std::size_t bit = 0; bit < N; ++bit)
      if (static_cast<std::int32_t>(packet - last_[bit]) >= 0) bits_ = static_cast<std::uint16_t>(bits_ & ~(1U << bit));
  }
  void clear(std::size_t bit) { bits_ = static_cast<std::uint16_t>(bits_ & ~(1U << bit)); }
  std::uint16_t bits() const { return bits_; }

 private:
  std::uint16_t bits_{};
  std::array<std::uint32_t, N> last_{};  // packet in which the bit was raised last
};

// Packets that wait for the host, one whose check is being computed, and one that is being filled.
class PacketRing {
 public:
  static constexpr std::size_t kPackets = 8;
  static constexpr std::size_t kPacketBytes =
      usb_probe::packetBytes(kMostSamplesAPacket, kCounters, usb_probe::kMostLatches, usb_probe::kMostEdges);
  struct Held {
    std::uint32_t number{};  // counts packets, kept or not
    std::size_t size{};
    std::array<std::byte, kPacketBytes> bytes;
  };

  // The one to be filled; null where there is no room.
  Held* open() { return waits() < kPackets ? &at(waits()) : nullptr; }
  void close() { checking_ = true; }
  // The one to be checked; null where there is none.
  Held* checking() { return checking_ ? &at(ready_) : nullptr; }
  void checked() {
    checking_ = false;
    ++ready_;
  }
  const Held* front() const { return ready_ > 0 ? &held_[first_] : nullptr; }
  void pop() { clear(1); }
  void clear() { clear(ready_); }

 private:
  std::size_t waits() const { return ready_ + (checking_ ? 1 : 0); }
  Held& at(std::size_t place) { return held_[(first_ + place) % kPackets]; }
  void clear(std::size_t packets) {
    first_ = (first_ + packets) % kPackets;
    ready_ -= packets;
  }

  std::array<Held, kPackets> held_{};
  std::size_t first_{}, ready_{};
  bool checking_{};
};

// What was latched with one sample.
struct Latched {
  std::array<std::uint32_t, kCounters> counts{};  // wrap
  std::uint8_t illegal{};                         // bit k: an illegal transition of counter k since the last sample
  std::uint8_t broken{};                          // bit k: its line receiver finds a broken wire
  bool has_deflection{};                          // the converter answered
  bool is_late{};                                 // it was not read before the next sample was taken
  std::array<std::int16_t, 3> deflection{};
};

class Assembly {
 public:
  // `run`: see PacketHeader. Its packets begin with sample 0.
  void start(const Settings& settings, std::uint8_t run);

  // The levels of the lines, or of the index inputs and the pin after them, changed. In the order of their times.
  // counts: those of all counters at a stamp of the index inputs.
  void lines(std::uint32_t stamp);
  void index(std::uint32_t stamp, const std::array<std::uint32_t, kCounters>& counts);
  // Changes of lines were lost; `stamp`: the last of them.
  void edgesLost(std::uint32_t stamp);
  void latchesLost();

  // A sample was taken. Changes before it have been told.
  void sample(const Latched& latched);
  // Goes on with the check of a packet, a part at a time. Called at least as often as sample().
  void work();

  void raise(usb_probe::ReceiverFault fault) { faults_.raise(static_cast<std::size_t>(fault), packet_); }
  // The host has taken the packet at the front.
  void taken();
  // A new host listens: what was dropped before is nothing to it.
  void discard();

  const PacketRing& packets() const { return ring_; }
  FrontEndCounters& counters() { return counters_; }
  const Settings& settings() const { return settings_; }

 private:
  struct Instant {
    std::uint32_t sample;
    std::uint32_t fraction;
  };
  Instant instantOf(std::uint32_t stamp) const;
  bool isAtStart(std::uint32_t stamp) const;
  void count(const Latched& latched, usb_probe::Sample& sample);
  void convert(const Latched& latched, usb_probe::Sample& sample);
  void lose(std::uint8_t line);
  void append(const usb_probe::Sample& sample);
  void close();

  Settings settings_;
  std::uint8_t run_{};
  std::uint32_t next_{};                           // sample
  std::uint32_t next_step_{};                      // at which it is taken; wraps
  std::uint64_t fraction_of_half_step_{};          // in 2^-48 of a sample period
  std::array<std::uint32_t, kCounters> latest_{};  // counts as they were latched
  std::array<std::int64_t, kCounters> total_{};    // counts that do not wrap
  std::array<std::int32_t, 3> last_nm_{};
  std::uint32_t overrun_{};  // counts in a sample that no counter holds
  std::uint32_t line_levels_{}, index_levels_{};
  std::array<std::uint16_t, usb_probe::kReceiverLines> sequence_{};
  std::array<std::uint8_t, usb_probe::kReceiverLines> lost_{};

  std::size_t samples_{};
  PacketRing::Held* open_{};  // null while its samples are dropped
  std::size_t latches_{};
  std::array<usb_probe::IndexLatch, usb_probe::kMostLatches> latch_{};
  std::size_t edges_{};
  std::array<usb_probe::LineEdge, usb_probe::kMostEdges> edge_{};

  std::uint32_t packet_{};
  UntilTaken<usb_probe::kReceiverFaults.size()> faults_;
  UntilTaken<kCounters> counter_faults_;
  PacketRing ring_;
  std::size_t checked_{};  // bytes
  std::uint32_t check_{};
  FrontEndCounters counters_;
};

// Checks settings before they are used.
RefusalCode whyRefused(const Settings& settings);

}  // namespace probebox::front_end
