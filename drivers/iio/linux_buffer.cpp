#include "drivers/iio/linux_buffer.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include "drivers/iio/linux_device.hpp"
#include "drivers/io/descriptor.hpp"

namespace probebox::iio {
namespace {

// Longer than the capture thread is ever late.
constexpr double kBufferedSeconds = 0.25;
constexpr double kLeastFrames = 64;
constexpr std::size_t kReadFrames = 64;  // at once

struct Enabled {
  NamedChannel named;
  double index{};  // in the scan
  ScanFormat format;
  Conversion conversion;
};

Outcome<Enabled> enable(const LinuxDevice& device, const NamedChannel& named) {
  const std::string element = "scan_elements/in_" + named.channel + "_";
  if (!device.has(element + "en"))
    return Error{"iio device " + device.name() + ": its buffer has no channel " + named.channel + " (" + element +
                 "en); correct it in box.toml, ls scan_elements in sysfs shows the names"};
  if (const auto refused = device.ensure(element + "en", "1")) return *refused;
  TRY(const auto index, device.number(element + "index"));
  TRY(const auto type, device.read(element + "type"));
  const auto format = parseScanFormat(type);
  if (!format) return Error{"iio device " + device.name() + ", channel " + named.channel + ": " + format.error().what};
  TRY(const auto conversion, conversionOf(device, named.channel, named.um_per_unit, named.zero_unit));
  return Enabled{named, index, *format, conversion};
}

std::optional<Error> enableStamps(const LinuxDevice& device) {
  if (!device.has("scan_elements/in_timestamp_en"))
    return Error{"iio device " + device.name() +
                 ": its frames have no stamps (scan_elements/in_timestamp_en), so nobody knows when they were taken; "
                 "use another converter, or read its screw sensors without the buffer (buffered = false)"};
  if (auto refused = device.ensure("scan_elements/in_timestamp_en", "1")) return refused;
  return device.ensure("current_timestamp_clock", "monotonic");
}

// Channels and stamps lie in the order of their scan index; the stamp's is the last.
FrameConfig frameOf(std::vector<Enabled> enabled, double rate_hz) {
  std::ranges::sort(enabled, {}, &Enabled::index);
  std::vector<ScanFormat> formats;
  for (const auto& channel : enabled) formats.push_back(channel.format);
  formats.push_back(kStampFormat);
  const auto layout = layOut(formats);
  FrameConfig frame{.period = Nanoseconds{std::llround(1e9 / rate_hz)},
                    .bytes = layout.bytes,
                    .stamp_offset = layout.offsets.back(),
                    .channels = {}};
  for (std::size_t i = 0; i < enabled.size(); ++i)
    frame.channels.push_back({enabled[i].named.measures, enabled[i].conversion, enabled[i].format, layout.offsets[i]});
  return frame;
}

std::optional<Error> setUpBuffer(const LinuxDevice& device, const DeviceChannels& channels) {
  const double frames = std::max(kLeastFrames, std::ceil(channels.rate_hz * kBufferedSeconds));
  if (auto refused = device.ensure("buffer/length", std::to_string(std::lround(frames)))) return refused;
  if (!channels.trigger.empty()) {
    if (auto refused = device.ensure("trigger/current_trigger", channels.trigger))
      return Error{"iio device " + device.name() + ": the trigger " + channels.trigger + " cannot be used (" +
                   refused->what + "); /sys/bus/iio/devices/trigger*/name shows which there are"};
  }
  return device.ensure("buffer/enable", "1");
}

Outcome<FrameConfig> setUp(const LinuxDevice& device, const DeviceChannels& channels) {
  if (const auto refused = device.ensure("buffer/enable", "0")) return *refused;
  if (const auto refused = device.disableScanElements()) return *refused;
  std::vector<Enabled> enabled;
  for (const auto& named : channels.channels) {
    TRY(auto channel, enable(device, named));
    enabled.push_back(std::move(channel));
  }
  if (const auto refused = enableStamps(device)) return *refused;
  if (const auto refused = setUpBuffer(device, channels)) return *refused;
  return frameOf(std::move(enabled), channels.rate_hz);
}

}  // namespace

struct LinuxBuffer::Running {
  Running(LinuxDevice found, io::Descriptor opened, FrameConfig config)
      : device{std::move(found)},
        fd{std::move(opened)},
        frame_bytes{config.bytes},
        bytes(kReadFrames * config.bytes),
        decoder{std::move(config)} {}

  LinuxDevice device;
  io::Descriptor fd;
  std::size_t frame_bytes;
  std::vector<std::byte> bytes;
  std::size_t begin{}, end{};  // of what was read and not decoded
  FrameDecoder decoder;
  std::array<Event, FrameDecoder::kMostEvents> decoded;  // of one frame, as far as the reader had no room
  std::size_t next{}, count{};
};

LinuxBuffer::LinuxBuffer(DeviceChannels channels) : channels_{std::move(channels)}, name_{describe(channels_)} {
  for (const auto& channel : channels_.channels)
    loss_.add(std::holds_alternative<OfProbe>(channel.measures) ? Source::probe : Source::drift);
}

LinuxBuffer::~LinuxBuffer() {
  // Others can then use the device; when it has gone there is nothing to do.
  if (running_) static_cast<void>(running_->device.write("buffer/enable", "0"));
}

int LinuxBuffer::descriptor() const {
  return running_ ? running_->fd.get() : -1;
}

std::uint64_t LinuxBuffer::unusable() const {
  return unusable_before_ + (running_ ? running_->decoder.unusable() : 0);
}

std::optional<Error> LinuxBuffer::open() {
  TRY(auto device, LinuxDevice::find(channels_.device));
  // First the node: it belongs to one program alone, and that one may be set up as it is.
  io::Descriptor fd{::open(device.node().c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
  if (!fd) {
    const int code = errno;
    return Error{"iio device " + channels_.device + ": " + device.node() + " cannot be opened: " +
                 (code == EBUSY    ? "another program reads it; stop that program"
                  : code == EACCES ? "no permission; install 60-probeboxd.rules (docs/service.md), and plug it in again"
                                   : std::strerror(code))};
  }
  TRY(auto frame, setUp(device, channels_));
  running_ = std::make_unique<Running>(std::move(device), std::move(fd), std::move(frame));
  running_->decoder.startRun(run_++);
  return std::nullopt;
}

std::size_t LinuxBuffer::read(std::span<Event> into, MonoTime now) {
  std::size_t count = loss_.read(into, now);
  if (!running_ && now >= next_try_) {
    next_try_ = now + kRetry;
    const auto refused = open();
    problem_ = refused ? refused->what : std::string{};
    is_wrong_rate_told_ = false;
  }
  if (running_) {
    count += deliver(into.subspan(count));
    if (running_) judge();
  }
  return count + loss_.read(into.subspan(count), now);
}

std::size_t LinuxBuffer::deliver(std::span<Event> into) {
  std::size_t count = 0;
  while (true) {
    auto& running = *running_;
    while (running.next < running.count && count < into.size()) into[count++] = running.decoded[running.next++];
    if (count == into.size()) return count;
    if (running.end - running.begin < running.frame_bytes && !fill()) return count;
    running.count =
        running.decoder.decode(std::span{running.bytes}.subspan(running.begin, running.frame_bytes), running.decoded);
    running.next = 0;
    running.begin += running.frame_bytes;
  }
}

// Reads until there is a whole frame; false when there is none now.
bool LinuxBuffer::fill() {
  auto& running = *running_;
  std::copy(running.bytes.begin() + static_cast<std::ptrdiff_t>(running.begin),
            running.bytes.begin() + static_cast<std::ptrdiff_t>(running.end), running.bytes.begin());
  running.end -= std::exchange(running.begin, 0);
  while (running.end < running.frame_bytes) {
    const auto room = std::span{running.bytes}.subspan(running.end);
    const auto got = ::read(running.fd.get(), room.data(), room.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN) return false;
    if (got <= 0) {
      lose();
      return false;
    }
    running.end += static_cast<std::size_t>(got);
  }
  return true;
}

void LinuxBuffer::lose() {
  unusable_before_ += running_->decoder.unusable();
  run_ = static_cast<std::uint8_t>(running_->decoder.counter().run() + 1);
  running_.reset();
  problem_ = "it has gone; plug it in again, or check its cable";
  loss_.raise();
}

void LinuxBuffer::judge() {
  const auto wrong_hz = running_->decoder.counter().wrongRateHz();
  if (wrong_hz.has_value() == is_wrong_rate_told_) return;
  is_wrong_rate_told_ = wrong_hz.has_value();
  problem_.clear();
  if (wrong_hz)
    problem_ = "it gives " + std::to_string(std::lround(*wrong_hz)) +
               " samples a second, and rate_hz of probe.toml is " + std::to_string(std::lround(channels_.rate_hz)) +
               ": correct rate_hz, or the rate of the trigger that starts its conversions";
}

}  // namespace probebox::iio
