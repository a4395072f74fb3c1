#include "drivers/usb_probe/decode.hpp"

#include <cmath>

namespace probebox::usb_probe {

ReceiverDecoder::ReceiverDecoder(const CounterAxes& axes, const WiredLines& lines, std::uint8_t receiver)
    : axes_{axes}, lines_{lines}, receiver_{receiver} {
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
      faults_ = static_cast<std::uint16_t>(faults_ | packet_.of_edges.faults);
      next_ = next_latch_ = next_edge_ = 0;
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
  decodeBetween(counter);
  inputs_.sample(packet_.header.run, counter, sample);
  events_[pending_++] = CountedDeflection{.run = packet_.header.run,
                                          .counter = counter,
                                          .channels_nm = sample.channels_nm,
                                          .clipped = (sample.status & status::kClipped) != 0,
                                          .newest = is_newest_ && ends_transfer,
                                          .at = arrived_,
                                          .receiver = receiver_};
  if (packet_.more.counters > 0 && axis_bits_ != 0) decodeCounts(counter, sample.status);
  ++next_;
  if (next_ < packet_.header.count) return;
  // What came after the last sample: its time is known from that one.
  decodeBetween(counter + 1);
  decodeLevels(counter);
}

// They come before the sample that was taken after them.
void ReceiverDecoder::decodeBetween(std::uint32_t counter) {
  const bool is_last_chance = next_ == packet_.header.count;
  const auto is_due = [&](std::uint32_t sample) {
    return is_last_chance || static_cast<std::int32_t>(sample - counter) < 0;
  };
  while (true) {
    std::optional<IndexLatch> latch;
    std::optional<LineEdge> edge;
    if (next_latch_ < packet_.more.latches) latch = packet_.latch(next_latch_);
    if (next_edge_ < packet_.of_edges.edges) edge = packet_.edge(next_edge_);
    if (latch && !is_due(latch->sample)) latch.reset();
    if (edge && !is_due(edge->sample)) edge.reset();
    if (!latch && !edge) return;
    const bool edge_first = edge && (!latch || static_cast<std::int32_t>(edge->sample - latch->sample) < 0 ||
                                     (edge->sample == latch->sample && edge->fraction <= latch->fraction));
    if (edge_first) {
      ++next_edge_;
      decodeEdge(*edge);
    } else {
      ++next_latch_;
      decodeLatch(*latch);
    }
  }
}

void ReceiverDecoder::decodeEdge(const LineEdge& edge) {
  if (edge.line == static_cast<std::uint8_t>(ReceiverLine::loop_back))
    inputs_.loopBack(packet_.header.run, packet_.of_edges.steps_a_sample, edge);
  if (edge.line >= lines_.size() || !lines_[edge.line]) return;
  auto& told = told_lines_[edge.line];
  // After a new run it counts from another number, and how many edges there were nobody knows.
  const bool goes_on = told.high && run_ == packet_.header.run;
  told.sequence += goes_on ? static_cast<std::uint16_t>(edge.sequence - told.sent) : 1U;
  told.sent = edge.sequence;
  run_ = packet_.header.run;
  push(edge.line, edge.level != 0, edge.sample, edge.fraction);
}

// A line whose level was not known, or changed in edges that are lost.
void ReceiverDecoder::decodeLevels(std::uint32_t counter) {
  if (packet_.header.version != PacketHeader::kWithEdges) return;
  for (std::size_t line = 0; line < lines_.size(); ++line) {
    const bool high = (unsigned{packet_.of_edges.levels} >> line & 1U) != 0;
    if (lines_[line] && lines_[line]->role != LineRole::sync && told_lines_[line].high != high)
      push(line, high, counter, 0);
  }
}

void ReceiverDecoder::push(std::size_t line, bool high, std::uint32_t counter, std::uint32_t fraction) {
  const auto& wired = *lines_[line];
  told_lines_[line].high = high;
  events_[pending_++] = CountedEdge{.run = packet_.header.run,
                                    .counter = counter,
                                    .fraction = fraction,
                                    .role = wired.role,
                                    .line = wired.line,
                                    .level = high != wired.active_low ? Level::active : Level::inactive,
                                    .line_sequence = told_lines_[line].sequence,
                                    .at = arrived_,
                                    .receiver = receiver_};
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
                                     .at = arrived_,
                                     .receiver = receiver_};
}

// A sum needs all its parts.
void ReceiverDecoder::decodeCounts(std::uint32_t counter, std::uint16_t status) {
  CountedAxes counted{.run = packet_.header.run, .counter = counter, .at = arrived_, .receiver = receiver_};
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
  inputs_.restart();
  packet_ = {};
  next_ = next_latch_ = next_edge_ = 0;
  for (auto& line : told_lines_) line.high.reset();
  pending_ = told_ = 0;
}

}  // namespace probebox::usb_probe
