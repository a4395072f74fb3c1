#include "drivers/usb_probe/decode.hpp"

#include <cmath>

namespace probebox::usb_probe {

ReceiverDecoder::ReceiverDecoder(const CounterAxes& axes) : axes_{axes} {
  for (const auto& axis : axes_)
    if (axis) axis_bits_ = static_cast<std::uint8_t>(axis_bits_ | 1U << axis->axis);
}

void ReceiverDecoder::begin(std::span<const std::byte> bytes, MonoTime arrived, bool is_newest) {
  reader_.beginTransfer(bytes);
  arrived_ = arrived;
  is_newest_ = is_newest;
}

std::size_t ReceiverDecoder::read(std::span<const std::byte>& bytes, std::span<Event> into) {
  std::size_t count = 0;
  while (count < into.size()) {
    if (told_ < pending_) {
      into[count++] = events_[told_++];
      continue;
    }
    if (next_ == packet_.header.count) {
      const auto packet = reader_.next(bytes);
      if (!packet) break;
      packet_ = *packet;
      next_ = next_latch_ = 0;
    }
    // A transfer that goes on, or ends in mid-packet, did not end because a sample had just been taken.
    const bool is_last = next_ + 1 == packet_.header.count;
    decodeSample(is_last && bytes.empty() && reader_.unfinished() == 0);
  }
  return count;
}

void ReceiverDecoder::decodeSample(bool ends_transfer) {
  pending_ = told_ = 0;
  const Sample sample = packet_.sample(next_);
  const auto counter = static_cast<std::uint32_t>(packet_.header.first + next_);
  decodeLatchesBefore(counter);
  events_[pending_++] = CountedDeflection{.run = packet_.header.run,
                                          .counter = counter,
                                          .channels_nm = sample.channels_nm,
                                          .clipped = (sample.status & status::kClipped) != 0,
                                          .newest = is_newest_ && ends_transfer,
                                          .at = arrived_};
  if (packet_.more.counters > 0 && axis_bits_ != 0) decodeCounts(counter, sample.status);
  ++next_;
  // A pulse after the last sample: its time is known from that one.
  if (next_ == packet_.header.count) decodeLatchesBefore(counter + 1);
}

// Index pulses come before the sample that was taken after them.
void ReceiverDecoder::decodeLatchesBefore(std::uint32_t counter) {
  for (; next_latch_ < packet_.more.latches; ++next_latch_) {
    const auto latch = packet_.latch(next_latch_);
    const bool is_later = static_cast<std::int32_t>(latch.sample - counter) >= 0;
    const bool is_last_chance = next_ == packet_.header.count;
    if (is_later && !is_last_chance) return;
    decodeLatch(latch);
  }
}

void ReceiverDecoder::decodeLatch(const IndexLatch& latch) {
  if (latch.counter >= packet_.more.counters) return;
  const auto& axis = axes_[latch.counter];
  if (!axis || !axis->has_index) return;
  events_[pending_++] = CountedIndex{.run = packet_.header.run,
                                     .counter = latch.sample,
                                     .fraction = latch.fraction,
                                     .axis = axis->axis,
                                     .counts = latch.counts,
                                     .at = arrived_};
}

// A sum needs all its parts.
void ReceiverDecoder::decodeCounts(std::uint32_t counter, std::uint16_t status) {
  CountedAxes counted{.run = packet_.header.run, .counter = counter, .at = arrived_};
  unsigned sent = 0, missing = 0, faults = 0;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto& axis = axes_[i];
    if (!axis) continue;
    const unsigned bit = 1U << axis->axis;
    if (i >= packet_.more.counters) {
      missing |= bit;
      continue;
    }
    sent |= bit;
    const auto count = packet_.count(next_, i);
    counted.counts[axis->axis] +=
        axis->counts_per_count == 0 ? count : std::llround(axis->counts_per_count * static_cast<double>(count));
    if ((std::uint32_t{status} >> (status::kFirstCounterFault + i) & 1U) != 0) faults |= bit;
  }
  counted.axes = static_cast<std::uint8_t>(sent & ~missing);
  counted.faults = static_cast<std::uint8_t>(faults & ~missing);
  events_[pending_++] = counted;
}

void ReceiverDecoder::restart() {
  reader_.restart();
  packet_ = {};
  next_ = next_latch_ = 0;
  pending_ = told_ = 0;
}

}  // namespace probebox::usb_probe
