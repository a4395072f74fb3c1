#include "firmware/front_end/core/assembly.hpp"

#include <algorithm>
#include <utility>

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::front_end {
namespace {

using usb_probe::ReceiverFault;

constexpr unsigned kStampBits = 32 - kStampedPins;
constexpr std::uint32_t kStampMask = (1U << kStampBits) - 1;
constexpr std::uint32_t kPinMask = (1U << kStampedPins) - 1;
// A counter that moves faster has a fault. Below, each state of A and B lasts longer than the longest loop of the
// counter (11 cycles of 8 ns), also where the signals are not symmetrical; 5 000 000 counts a second are promised.
constexpr std::uint32_t kMostCountsHz = 6'000'000;
// Readings this close to the end of the converter's range are clipped.
constexpr std::int32_t kClipped = 32'700;

constexpr std::size_t kHeadersBytes =
    usb_probe::kHeaderBytes + usb_probe::kCountersHeaderBytes + usb_probe::kEdgesHeaderBytes;
// A pass of the program stays short.
constexpr std::size_t kCheckedAtOnce = 64;

constexpr std::uint32_t stepOf(std::uint32_t stamp) {
  return (0U - (stamp >> kStampedPins)) & kStampMask;
}

}  // namespace

RefusalCode whyRefused(const Settings& settings) {
  if (settings.steps_a_sample < kLeastSteps || settings.steps_a_sample > kMostSteps)
    return RefusalCode::bad_steps_a_sample;
  if (settings.samples_a_packet == 0 || settings.samples_a_packet > kMostSamplesAPacket)
    return RefusalCode::bad_samples_a_packet;
  const auto sync = settings.sync_out_steps;
  if (sync != 0 && (sync < kLeastSyncOutSteps || sync > kMostSyncOutSteps)) return RefusalCode::bad_sync_out_steps;
  for (const auto nm : settings.full_scale_nm)
    if (nm == 0 || nm < -100'000'000 || nm > 100'000'000) return RefusalCode::bad_full_scale;
  return RefusalCode::none;
}

void Assembly::start(const Settings& settings, std::uint8_t run) {
  settings_ = settings;
  run_ = run;
  next_ = 0;
  next_step_ = 0;
  samples_ = latches_ = edges_ = 0;
  open_ = nullptr;
  line_levels_ = index_levels_ = 0;
  ring_.clear();
  latest_ = {};
  total_ = {};
  fraction_of_half_step_ = (std::uint64_t{1} << 48U) / (2 * std::uint64_t{settings.steps_a_sample});
  overrun_ =
      static_cast<std::uint32_t>(std::uint64_t{kMostCountsHz} * kCyclesAStep * settings.steps_a_sample / kSystemHz);
}

// Without divisions, which the processor does not have: stamps are read within a sample or two. The pins changed in the
// step before the one in which they were seen: in its middle, on average.
Assembly::Instant Assembly::instantOf(std::uint32_t stamp) const {
  constexpr std::uint32_t kHalfRange = (kStampMask + 1) / 2;
  const std::uint32_t since = (stepOf(stamp) - next_step_) & kStampMask;
  const auto steps =
      static_cast<std::int32_t>(since) - (since >= kHalfRange ? static_cast<std::int32_t>(kStampMask) + 1 : 0);
  const auto period = static_cast<std::int32_t>(2 * settings_.steps_a_sample);
  std::int32_t half_steps = 2 * steps - 1;
  Instant instant{next_, 0};
  for (; half_steps < 0 && instant.sample > 0; half_steps += period) --instant.sample;
  for (; half_steps >= period; half_steps -= period) ++instant.sample;
  if (half_steps > 0)
    instant.fraction =
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(half_steps) * fraction_of_half_step_ >> 16U);
  return instant;
}

// The first stamp of all tells the levels with which the lines began.
bool Assembly::isAtStart(std::uint32_t stamp) const {
  return next_ == 0 && stepOf(stamp) == 0;
}

void Assembly::lines(std::uint32_t stamp) {
  const auto levels = stamp & kPinMask;
  const auto changed = std::exchange(line_levels_, levels) ^ levels;
  if (isAtStart(stamp)) return;
  const auto at = instantOf(stamp);
  for (std::uint8_t line = 0; line < usb_probe::kReceiverLines; ++line) {
    if ((changed >> line & 1U) == 0) continue;
    ++sequence_[line];
    if (edges_ == edge_.size()) {
      lose(line);
      continue;
    }
    edge_[edges_++] = {.sample = at.sample,
                       .fraction = at.fraction,
                       .line = line,
                       .level = static_cast<std::uint8_t>(levels >> line & 1U),
                       .sequence = sequence_[line],
                       .lost = std::exchange(lost_[line], std::uint8_t{0})};
  }
}

void Assembly::lose(std::uint8_t line) {
  if (lost_[line] < 255) ++lost_[line];
  ++counters_.edges_lost;
  raise(ReceiverFault::edges_lost);
}

void Assembly::edgesLost(std::uint32_t stamp) {
  line_levels_ = stamp & kPinMask;
  lost_.fill(255);
  ++counters_.edges_lost;
  raise(ReceiverFault::edges_lost);
}

void Assembly::index(std::uint32_t stamp, const std::array<std::uint32_t, kCounters>& counts) {
  const auto levels = stamp & kPinMask;
  const auto risen = levels & ~std::exchange(index_levels_, levels);
  if (isAtStart(stamp)) return;
  const auto at = instantOf(stamp);
  for (std::uint8_t k = 0; k < kCounters; ++k) {
    if ((risen >> k & 1U) == 0) continue;
    if (latches_ == latch_.size()) {
      latchesLost();
      continue;
    }
    latch_[latches_++] = {.sample = at.sample,
                          .fraction = at.fraction,
                          .counter = k,
                          .counts = total_[k] + static_cast<std::int32_t>(counts[k] - latest_[k])};
  }
}

void Assembly::latchesLost() {
  ++counters_.latches_lost;
  raise(ReceiverFault::latches_lost);
}

void Assembly::sample(const Latched& latched) {
  usb_probe::Sample sample;
  count(latched, sample);
  convert(latched, sample);
  append(sample);
  ++counters_.samples;
  ++next_;
  next_step_ += settings_.steps_a_sample;
  if (++samples_ >= settings_.samples_a_packet) close();
}

void Assembly::append(const usb_probe::Sample& sample) {
  if (samples_ == 0) open_ = ring_.open();
  if (open_ == nullptr) return;
  if (samples_ == 0) open_->size = kHeadersBytes;
  frame::ByteWriter writer{std::span{open_->bytes}.subspan(open_->size)};
  messages::detail::encodeFields(writer, sample);
  for (const auto total : total_) writer.put(total);
  open_->size += writer.size();
}

void Assembly::count(const Latched& latched, usb_probe::Sample& sample) {
  for (std::size_t k = 0; k < kCounters; ++k) {
    const auto moved = static_cast<std::int32_t>(latched.counts[k] - std::exchange(latest_[k], latched.counts[k]));
    total_[k] += moved;
    const bool overrun = static_cast<std::uint32_t>(moved < 0 ? -moved : moved) > overrun_;
    const bool illegal = (latched.illegal >> k & 1U) != 0;
    const bool broken = (latched.broken >> k & 1U) != 0;
    if (overrun) {
      ++counters_.overruns[k];
      raise(ReceiverFault::counter_overrun);
    }
    if (illegal) ++counters_.illegal_transitions[k];
    if (broken) faults_.raise(static_cast<std::size_t>(ReceiverFault::wires_1) + k, packet_);
    if (overrun || illegal || broken) counter_faults_.raise(k, packet_);
  }
  sample.status = static_cast<std::uint16_t>(counter_faults_.bits() << usb_probe::status::kFirstCounterFault);
}

// Without an answer of the converter the last deflection is repeated, and marked as out of range: nobody measures by
// it.
void Assembly::convert(const Latched& latched, usb_probe::Sample& sample) {
  bool clipped = !latched.has_deflection;
  for (std::size_t i = 0; i < last_nm_.size() && latched.has_deflection; ++i) {
    const std::int32_t raw = latched.deflection[i];
    last_nm_[i] = static_cast<std::int32_t>(std::int64_t{settings_.full_scale_nm[i]} * raw / 32'768);
    clipped = clipped || raw > kClipped || raw < -kClipped;
  }
  sample.channels_nm = last_nm_;
  if (clipped) sample.status |= usb_probe::status::kClipped;
  if (latched.has_deflection) return;
  ++(latched.is_late ? counters_.deflections_late : counters_.converter_silent);
  raise(latched.is_late ? ReceiverFault::deflections_late : ReceiverFault::converter_silent);
}

void Assembly::close() {
  const std::size_t samples = std::exchange(samples_, std::size_t{0});
  if (open_ != nullptr) {
    while (ring_.checking() != nullptr) work();
    frame::ByteWriter headers{open_->bytes};
    messages::detail::encodeFields(headers,
                                   usb_probe::PacketHeader{.version = usb_probe::PacketHeader::kWithEdges,
                                                           .run = run_,
                                                           .count = static_cast<std::uint16_t>(samples),
                                                           .first = static_cast<std::uint32_t>(next_ - samples)});
    messages::detail::encodeFields(headers,
                                   usb_probe::CountersHeader{kCounters, static_cast<std::uint8_t>(latches_), 0});
    messages::detail::encodeFields(
        headers, usb_probe::EdgesHeader{static_cast<std::uint8_t>(edges_), static_cast<std::uint8_t>(line_levels_),
                                        faults_.bits(), settings_.steps_a_sample});
    frame::ByteWriter rest{std::span{open_->bytes}.subspan(open_->size)};
    for (std::size_t i = 0; i < latches_; ++i) messages::detail::encodeFields(rest, latch_[i]);
    for (std::size_t i = 0; i < edges_; ++i) messages::detail::encodeFields(rest, edge_[i]);
    open_->size += rest.size();
    open_->number = packet_;
    checked_ = 0;
    check_ = 0;
    ring_.close();
  } else {
    counters_.samples_dropped += static_cast<std::uint32_t>(samples);
    raise(ReceiverFault::samples_dropped);
    for (std::size_t i = 0; i < edges_; ++i) {
      auto& lost = lost_[edge_[i].line];
      lost = static_cast<std::uint8_t>(std::min(255, lost + edge_[i].lost + 1));
    }
  }
  latches_ = edges_ = 0;
  ++packet_;
}

void Assembly::work() {
  auto* const held = ring_.checking();
  if (held == nullptr) return;
  const auto part = std::span{held->bytes}.subspan(checked_, std::min(held->size - checked_, kCheckedAtOnce));
  check_ = frame::crc32c(part, check_);
  checked_ += part.size();
  if (checked_ < held->size) return;
  frame::ByteWriter writer{std::span{held->bytes}.subspan(held->size)};
  writer.put(check_);
  held->size += writer.size();
  ring_.checked();
}

void Assembly::discard() {
  ring_.clear();
  faults_.clear(static_cast<std::size_t>(ReceiverFault::samples_dropped));
}

void Assembly::taken() {
  const auto* const held = ring_.front();
  if (held == nullptr) return;
  faults_.taken(held->number);
  counter_faults_.taken(held->number);
  ring_.pop();
}

}  // namespace probebox::front_end
