#include "drivers/iio/emulator.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace probebox::iio {

EmulatedConverter::EmulatedConverter(Config config, MonoTime start)
    : config_{std::move(config)}, start_{start}, period_ns_{1e9 / config_.rate_hz * (1 + config_.offset_ppm * 1e-6)} {
  std::vector<ScanFormat> formats;
  for (const auto& channel : config_.channels) formats.push_back(channel.format);
  formats.push_back(kStampFormat);
  layout_ = layOut(formats);
}

MonoTime EmulatedConverter::takenAt(std::uint64_t frame) const {
  return start_ + Nanoseconds{std::llround(static_cast<double>(frame) * period_ns_)};
}

void EmulatedConverter::advanceTo(MonoTime now) {
  while (takenAt(taken_) <= now) take(takenAt(taken_++));
}

void EmulatedConverter::take(MonoTime at) {
  const auto late = config_.lateness();
  if (buffer_.size() >= config_.buffer_frames * layout_.bytes) {
    ++dropped_;
    return;
  }
  buffer_.resize(buffer_.size() + layout_.bytes);
  const auto frame = std::span{buffer_}.last(layout_.bytes);
  for (std::size_t i = 0; i < config_.channels.size(); ++i) {
    const auto& channel = config_.channels[i];
    const double number = channel.physical(at - start_) / channel.scale - channel.offset;
    writeValue(channel.format, std::llround(number), frame.subspan(layout_.offsets[i]));
  }
  writeValue(kStampFormat, toNs(at + late), frame.subspan(layout_.offsets.back()));
}

std::size_t EmulatedConverter::read(std::span<std::byte> into) {
  const std::size_t size = std::min(into.size(), buffer_.size()) / layout_.bytes * layout_.bytes;
  std::copy_n(buffer_.begin(), size, into.begin());
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(size));
  return size;
}

}  // namespace probebox::iio
