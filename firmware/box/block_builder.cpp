#include "firmware/box/block_builder.hpp"

#include <algorithm>

namespace probebox::box {
namespace {

constexpr std::array<codec::ChannelFormat, latch::kChannels> kFormats{{
    {4, true},   // d1, nm
    {4, true},   // d2, nm
    {4, true},   // d3, nm
    {8, true},   // x, counts
    {8, true},   // y, counts
    {8, true},   // z, counts
    {2, false},  // flags
}};

}  // namespace

std::span<const codec::ChannelFormat> channelFormats() {
  return kFormats;
}

BlockBuilder::BlockBuilder(std::size_t samples, std::uint16_t samples_per_tick)
    : samples_{samples},
      encoder_{{kFormats.begin(), kFormats.end()}, codec::Profile::raw},
      columns_(samples * latch::kChannels),
      packed_(samples * latch::kChannels),
      bytes_(codec::rawBlockSize(kFormats, samples)) {
  header_.samples_per_tick = samples_per_tick;
}

void BlockBuilder::add(const latch::Record& record, const TickMap& map, MonoTime now) {
  if (empty()) {
    header_.first = record.index;
    opened_ = now;
  }
  header_.map = map;
  for (std::size_t channel = 0; channel < latch::kChannels; ++channel)
    columns_[channel * samples_ + header_.count] = record.values[channel];
  ++header_.count;
}

std::span<const std::byte> BlockBuilder::close() {
  const std::size_t count = header_.count;
  for (std::size_t channel = 0; channel < latch::kChannels; ++channel)
    std::copy_n(&columns_[channel * samples_], count, &packed_[channel * count]);
  const auto size = encoder_.encode(header_, std::span{packed_}.first(latch::kChannels * count), bytes_);
  header_.count = 0;
  return size ? std::span<const std::byte>{bytes_}.first(*size) : std::span<const std::byte>{};
}

}  // namespace probebox::box
