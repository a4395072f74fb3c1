#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/usb_probe/packet_reader.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::usb_probe {

// Decodes transfers of a probe receiver to events. Pure; never allocates.
class ReceiverDecoder {
 public:
  ReceiverDecoder() = default;
  ReceiverDecoder(const ReceiverDecoder&) = delete;
  ReceiverDecoder& operator=(const ReceiverDecoder&) = delete;

  // `bytes`: a whole transfer, completed at `arrived`. is_newest: no later transfer has completed; only then was its
  // last sample just taken.
  void begin(std::span<const std::byte> bytes, MonoTime arrived, bool is_newest);

  // Consumes bytes from the front of `bytes` and writes their samples; returns their number. Consumes all bytes for
  // whose samples there is room.
  std::size_t read(std::span<const std::byte>& bytes, std::span<Event> into);

  // True when no sample waits for room.
  bool idle() const { return next_ == packet_.header.count; }
  std::size_t unfinished() const { return reader_.unfinished(); }  // bytes of an unfinished packet
  const PacketCounters& counters() const { return reader_.counters(); }

  // Discards everything: the device was opened again.
  void restart();

 private:
  PacketReader reader_;
  Packet packet_;
  std::size_t next_{};  // sample of the packet
  MonoTime arrived_{};
  bool is_newest_{};
};

}  // namespace probebox::usb_probe
