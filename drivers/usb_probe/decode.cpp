#include "drivers/usb_probe/decode.hpp"

namespace probebox::usb_probe {

void ReceiverDecoder::begin(std::span<const std::byte> bytes, MonoTime arrived, bool is_newest) {
  reader_.beginTransfer(bytes);
  arrived_ = arrived;
  is_newest_ = is_newest;
}

std::size_t ReceiverDecoder::read(std::span<const std::byte>& bytes, std::span<Event> into) {
  std::size_t count = 0;
  while (count < into.size()) {
    if (idle()) {
      const auto packet = reader_.next(bytes);
      if (!packet) break;
      packet_ = *packet;
      next_ = 0;
    }
    const Sample sample = packet_.sample(next_);
    const auto counter = static_cast<std::uint32_t>(packet_.header.first + next_);
    ++next_;
    // A transfer that goes on, or ends in mid-packet, did not end because a sample had just been taken.
    const bool ends_transfer = idle() && bytes.empty() && reader_.unfinished() == 0;
    into[count++] = CountedDeflection{.run = packet_.header.run,
                                      .counter = counter,
                                      .channels_nm = sample.channels_nm,
                                      .clipped = (sample.status & status::kClipped) != 0,
                                      .newest = is_newest_ && ends_transfer,
                                      .at = arrived_};
  }
  return count;
}

void ReceiverDecoder::restart() {
  reader_.restart();
  packet_ = {};
  next_ = 0;
}

}  // namespace probebox::usb_probe
