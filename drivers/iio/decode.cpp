#include "drivers/iio/decode.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace probebox::iio {
namespace {

// A screw warms up over minutes; 20 readings a second follow it, and the mean has less noise than a sample.
constexpr Nanoseconds kMean = std::chrono::milliseconds{50};

}  // namespace

std::int32_t wholeNm(double nm) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::lround(std::clamp(nm, -kMost, kMost)));
}

FrameDecoder::FrameDecoder(FrameConfig config) : config_{std::move(config)}, counter_{config_.period} {
  for (const auto& channel : config_.channels) {
    has_probe_ |= std::holds_alternative<OfProbe>(channel.measures);
    has_screw_ |= std::holds_alternative<OfScrew>(channel.measures);
  }
  frames_a_mean_ = static_cast<int>(std::max<std::int64_t>(1, kMean / config_.period));
}

std::int64_t FrameDecoder::number(const FrameChannel& channel, std::span<const std::byte> frame) const {
  return readValue(channel.format, frame.subspan(channel.offset, channel.format.bytes()));
}

std::size_t FrameDecoder::decode(std::span<const std::byte> frame, std::span<Event> into) {
  const MonoTime at = monoTime(readValue(kStampFormat, frame.subspan(config_.stamp_offset, kStampFormat.bytes())));
  if (last_at_ && at <= *last_at_) {
    ++unusable_;
    return 0;
  }
  last_at_ = at;
  std::size_t count = 0;
  if (has_probe_) {
    if (const auto counted = deflection(frame, at)) into[count++] = *counted;
  }
  return count + screws(frame, at, into.subspan(count));
}

std::optional<CountedDeflection> FrameDecoder::deflection(std::span<const std::byte> frame, MonoTime at) {
  const auto before = counter_.push(at);
  auto counted = std::exchange(held_, {});
  // Each frame has the kernel's own stamp of its trigger: all of them show the device's time.
  held_.newest = true;
  held_.at = at;
  for (const auto& channel : config_.channels) {
    const auto* const probe = std::get_if<OfProbe>(&channel.measures);
    if (probe == nullptr) continue;
    const auto value = number(channel, frame);
    held_.clipped |= value <= channel.format.least() || value >= channel.format.greatest();
    held_.channels_nm[probe->channel] = wholeNm(channel.conversion.nm(static_cast<double>(value)));
  }
  if (!before) return std::nullopt;
  counted.run = before->run;
  counted.counter = before->counter;
  return counted;
}

std::size_t FrameDecoder::screws(std::span<const std::byte> frame, MonoTime at, std::span<Event> into) {
  if (!has_screw_) return 0;
  if (in_mean_ == 0) {
    mean_from_ = at;
    means_ = {};
  }
  ++in_mean_;
  const bool complete = in_mean_ == frames_a_mean_;
  std::size_t count = 0;
  for (const auto& channel : config_.channels) {
    const auto* const screw = std::get_if<OfScrew>(&channel.measures);
    if (screw == nullptr) continue;
    auto& mean = means_[static_cast<std::size_t>(screw->axis)];
    mean.sum_nm += channel.conversion.nm(static_cast<double>(number(channel, frame)));
    mean.sum_ns += static_cast<double>((at - mean_from_).count());
    if (!complete) continue;
    into[count++] = Drift{.axis = screw->axis,
                          .reading_nm = wholeNm(mean.sum_nm / in_mean_),
                          .at = mean_from_ + Nanoseconds{std::llround(mean.sum_ns / in_mean_)}};
  }
  if (complete) in_mean_ = 0;
  return count;
}

void FrameDecoder::startRun(std::uint8_t run) {
  counter_.startRun(run);
  last_at_.reset();
  held_ = {};
  in_mean_ = 0;
}

}  // namespace probebox::iio
