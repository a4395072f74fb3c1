#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "drivers/io/encoder_axis.hpp"
#include "drivers/usb_probe/input_figures.hpp"
#include "drivers/usb_probe/packet_reader.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::usb_probe {

// Axis to which a counter of a receiver is wired.
struct CounterAxis {
  std::uint8_t axis{};  // place in X Y Z A B C
  bool has_index{};     // its index latches are used
  // 0: of that axis itself; else of the secondary axis that is added to it, and what one of its counts adds.
  double counts_per_count{};
};
constexpr char letterOf(const CounterAxis& axis) {
  return io::EncoderAxis{axis.axis + (axis.counts_per_count != 0 ? io::EncoderAxis::kSecondary : 0)}.letter();
}
using CounterAxes = std::array<std::optional<CounterAxis>, kMostCounters>;

// What a line of a receiver is for.
struct WiredLine {
  LineRole role{};
  std::uint8_t line{};  // number within the role
  bool active_low{};
};
using WiredLines = std::array<std::optional<WiredLine>, kReceiverLines>;

// Decodes transfers of a probe receiver to events: for each sample CountedDeflection, then CountedAxes of the axes that
// are wired, with CountedIndex and CountedEdge in between where an index pulse or an edge came. Pure; never allocates.
class ReceiverDecoder {
 public:
  // receiver: 0 the first, 1 the second, as its events say.
  explicit ReceiverDecoder(const CounterAxes& axes = {}, const WiredLines& lines = {}, std::uint8_t receiver = 0);
  ReceiverDecoder(const ReceiverDecoder&) = delete;
  ReceiverDecoder& operator=(const ReceiverDecoder&) = delete;

  // `bytes`: a whole transfer, completed at `arrived`. is_newest: no later transfer has completed; only then was its
  // last sample just taken.
  void begin(std::span<const std::byte> bytes, MonoTime arrived, bool is_newest);

  // Consumes bytes from the front of `bytes` and writes their samples; returns their number. Consumes all bytes for
  // whose samples there is room.
  std::size_t read(std::span<const std::byte>& bytes, std::span<Event> into);

  // True when no sample waits for room.
  bool idle() const { return next_ == packet_.header.count && told_ == pending_; }
  std::size_t unfinished() const { return reader_.unfinished(); }  // bytes of an unfinished packet
  const PacketCounters& counters() const { return reader_.counters(); }
  // Number of axis counters in the last packet.
  std::size_t axisCounters() const { return packet_.more.counters; }
  // axisBit() of each axis that is wired.
  std::uint8_t axes() const { return axis_bits_; }
  const WiredLines& lines() const { return lines_; }
  // Version of the last packet; 0 before the first.
  std::uint8_t version() const { return packet_.header.count == 0 ? std::uint8_t{0} : packet_.header.version; }
  // Bits of EdgesHeader::faults in the packets since the last call.
  std::uint16_t takeFaults() { return std::exchange(faults_, std::uint16_t{0}); }

  const InputFigures& inputs() const { return inputs_; }

  // Discards all state, for a device that was opened again.
  void restart();

 private:
  void decodeSample(bool ends_transfer);
  // Index pulses and edges before the sample with this number, in the order of their times.
  void decodeBetween(std::uint32_t counter);
  void decodeEdge(const LineEdge& edge);
  void decodeLevels(std::uint32_t counter);
  void push(std::size_t line, bool high, std::uint32_t counter, std::uint32_t fraction);
  void decodeLatch(const IndexLatch& latch);
  void decodeCounts(std::uint32_t counter, std::uint16_t status);

  // Of a line, as it was told.
  struct Told {
    std::uint32_t sequence{};
    std::uint16_t sent{};  // sequence as the receiver counts
    std::optional<bool> high{};
  };

  CounterAxes axes_;
  WiredLines lines_;
  std::uint8_t receiver_;
  std::array<Told, kReceiverLines> told_lines_{};
  std::optional<std::uint8_t> run_;
  std::uint16_t faults_{};
  InputFigures inputs_;
  std::uint8_t axis_bits_{};
  PacketReader reader_;
  Packet packet_;
  std::size_t next_latch_{}, next_edge_{};                                    // of the packet
  std::array<Event, 2 + kMostLatches + kMostEdges + kReceiverLines> events_;  // of one sample
  std::size_t pending_{};
  std::size_t told_{};
  std::size_t next_{};  // sample of the packet
  MonoTime arrived_{};
  bool is_newest_{};
};

}  // namespace probebox::usb_probe
