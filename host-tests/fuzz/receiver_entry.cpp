#include "receiver_entry.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <span>

#include "drivers/usb_probe/decode.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;

// Eight counters on six axes, of which one has no axis and one no use for its index.
usb_probe::CounterAxes wiring() {
  usb_probe::CounterAxes axes{};
  for (std::uint8_t i = 0; i < 6; ++i) axes.at(i + 1U) = {.axis = i, .has_index = i != 3};
  return axes;
}

constexpr usb_probe::WiredLines kLines{usb_probe::WiredLine{LineRole::sync}, usb_probe::WiredLine{LineRole::trigger},
                                       usb_probe::WiredLine{LineRole::skip}, std::nullopt,
                                       usb_probe::WiredLine{LineRole::inhibit, 15, true}};

// Samples of one transfer; in order within a packet, and only the last one may tell the time. Counts are those of the
// sample before.
void take(usb_probe::ReceiverDecoder& decoder, std::span<const std::byte> transfer, MonoTime arrived,
          std::size_t room) {
  std::array<Event, 64> events;
  bool ended = false;
  std::uint32_t last = 0;
  decoder.begin(transfer, arrived, true);
  while (const std::size_t count = decoder.read(transfer, std::span{events}.first(room))) {
    for (const auto& event : std::span{events}.first(count)) {
      require(stampOf(event) == arrived);
      if (const auto* const axes = std::get_if<CountedAxes>(&event)) require(axes->counter == last && axes->axes < 64);
      if (const auto* const edge = std::get_if<CountedEdge>(&event)) require(edge->line == 0 || edge->line == 15);
      const auto* const sample = std::get_if<CountedDeflection>(&event);
      if (sample == nullptr) continue;
      require(!ended);
      ended = sample->newest;
      last = sample->counter;
    }
  }
  require(transfer.empty() && decoder.idle());
}

}  // namespace

int feedReceiver(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 2) return 0;
  const std::size_t piece = 1 + data[0] * std::size_t{16};
  const std::size_t room = 1 + data[1] % 64;
  auto bytes = std::as_bytes(std::span{data + 2, size - 2});
  const auto decoder = std::make_unique<usb_probe::ReceiverDecoder>(wiring(), kLines);
  MonoTime arrived{};
  while (!bytes.empty()) {
    const auto transfer = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(transfer.size());
    take(*decoder, transfer, arrived += Nanoseconds{1'000'000}, room);
  }
  const auto& counters = decoder->counters();
  require(counters.packet_bytes + counters.discarded_bytes + decoder->unfinished() == size - 2);
  return 0;
}
