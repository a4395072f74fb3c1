#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/usb_probe/packet_reader.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::usb_probe {

// Bytes of transfers in, events out. Pure: no device, no clock; never allocates.
//
//   decoder.begin(bytes, arrived, is_newest);
//   count += decoder.read(bytes, into);  // again until `bytes` is empty and nothing comes
class ReceiverDecoder {
 public:
  ReceiverDecoder() = default;
  ReceiverDecoder(const ReceiverDecoder&) = delete;
  ReceiverDecoder& operator=(const ReceiverDecoder&) = delete;

  // `bytes`: a whole transfer, which came back at `arrived`. is_newest: nothing that came after it is
  // known yet; only then its last sample is one that has just been taken.
  void begin(std::span<const std::byte> bytes, MonoTime arrived, bool is_newest);

  // Takes bytes of that transfer from the front of `bytes`, and gives their samples; how many. Takes all of them where
  // there is room for their samples.
  std::size_t read(std::span<const std::byte>& bytes, std::span<Event> into);

  // No sample waits for room.
  bool idle() const { return next_ == packet_.header.count; }
  std::size_t unfinished() const { return reader_.unfinished(); }  // bytes of a packet whose end has not come yet
  const PacketCounters& counters() const { return reader_.counters(); }

  // The device was opened anew: nothing of before goes on.
  void restart();

 private:
  PacketReader reader_;
  Packet packet_;
  std::size_t next_{};  // sample of the packet
  MonoTime arrived_{};
  bool is_newest_{};
};

}  // namespace probebox::usb_probe
