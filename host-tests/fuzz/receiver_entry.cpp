#include "receiver_entry.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <span>

#include "drivers/usb_probe/decode.hpp"

namespace {

using namespace probebox;

void require(bool condition) {
  if (!condition) std::abort();
}

// Samples of one transfer; in order within a packet, and only the last one may tell the time.
std::uint64_t take(usb_probe::ReceiverDecoder& decoder, std::span<const std::byte> transfer, MonoTime arrived,
                   std::size_t room) {
  std::array<Event, 64> events;
  std::uint64_t samples = 0;
  bool ended = false;
  decoder.begin(transfer, arrived, true);
  while (const std::size_t count = decoder.read(transfer, std::span{events}.first(room))) {
    for (const auto& event : std::span{events}.first(count)) {
      const auto& sample = std::get<CountedDeflection>(event);
      require(!ended && sample.at == arrived);
      ended = sample.newest;
      ++samples;
    }
  }
  require(transfer.empty() && decoder.idle());
  return samples;
}

}  // namespace

int feedReceiver(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t piece = 1 + data[0] * std::size_t{16};
  const std::size_t room = 1 + data[1] % 64;
  auto bytes = std::as_bytes(std::span{data + 2, size - 2});
  const auto decoder = std::make_unique<usb_probe::ReceiverDecoder>();
  std::uint64_t samples = 0;
  MonoTime arrived{};
  while (!bytes.empty()) {
    const auto transfer = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(transfer.size());
    samples += take(*decoder, transfer, arrived += Nanoseconds{1'000'000}, room);
  }
  const auto& counters = decoder->counters();
  const std::uint64_t in_packets = counters.packets * usb_probe::packetBytes(0) + samples * usb_probe::kSampleBytes;
  require(in_packets + counters.discarded_bytes + decoder->unfinished() == size - 2);
  return 0;
}
