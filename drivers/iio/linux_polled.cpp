#include "drivers/iio/linux_polled.hpp"

#include <chrono>
#include <cmath>
#include <ctime>
#include <pthread.h>
#include <utility>

#include "drivers/iio/linux_device.hpp"

namespace probebox::iio {
namespace {

// More than a second of readings: beyond, the oldest has no use any more.
constexpr std::size_t kMostWaiting = 256;

MonoTime kernelNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

}  // namespace

struct LinuxPolled::Found {
  LinuxDevice device;
  std::vector<Conversion> conversions;  // of the channels
};

LinuxPolled::LinuxPolled(DeviceChannels channels) : channels_{std::move(channels)}, name_{describe(channels_)} {
  loss_.add(Source::drift);
  thread_ = std::thread{[this] { run(); }};
  pthread_setname_np(thread_.native_handle(), "sensors");
}

LinuxPolled::~LinuxPolled() {
  {
    const std::lock_guard lock{mutex_};
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LinuxPolled::run() {
  const auto period = std::chrono::nanoseconds{std::llround(1e9 / channels_.rate_hz)};
  std::optional<Found> found;
  auto next = std::chrono::steady_clock::now();
  while (true) {
    const auto error = readAll(found);
    if (error) found.reset();
    tell(error);
    std::unique_lock lock{mutex_};
    next = std::max(next + period, std::chrono::steady_clock::now());
    if (wake_.wait_until(lock, next, [this] { return stopping_; })) return;
  }
}

std::optional<Error> LinuxPolled::readAll(std::optional<Found>& found) {
  if (!found) {
    TRY(auto device, LinuxDevice::find(channels_.device));
    std::vector<Conversion> conversions;
    for (const auto& channel : channels_.channels) {
      TRY(const auto conversion, conversionOf(device, channel.channel, channel.um_per_unit, channel.zero_unit));
      conversions.push_back(conversion);
    }
    found.emplace(std::move(device), std::move(conversions));
  }
  for (std::size_t i = 0; i < channels_.channels.size(); ++i) {
    const auto& channel = channels_.channels[i];
    const MonoTime before = kernelNow();
    const auto number = found->device.number("in_" + channel.channel + "_raw");
    const MonoTime after = kernelNow();
    if (!number) return number.error();
    const Drift drift{.axis = std::get<OfScrew>(channel.measures).axis,
                      .reading_nm = wholeNm(found->conversions[i].nm(*number)),
                      .at = before + (after - before) / 2};
    const std::lock_guard lock{mutex_};
    if (readings_.size() == kMostWaiting) readings_.pop_front();
    readings_.push_back(drift);
  }
  return std::nullopt;
}

void LinuxPolled::tell(const std::optional<Error>& error) {
  const std::lock_guard lock{mutex_};
  problem_now_ = error ? error->what : std::string{};
  has_failed_ |= std::exchange(works_, !error) && error;
}

std::size_t LinuxPolled::read(std::span<Event> into, MonoTime now) {
  std::size_t count = loss_.read(into, now);
  // The reader holds it for moments only; what waits is there the next time.
  const std::unique_lock lock{mutex_, std::try_to_lock};
  if (!lock) return count;
  while (count < into.size() && !readings_.empty()) {
    into[count++] = readings_.front();
    readings_.pop_front();
  }
  if (problem_ != problem_now_) problem_ = problem_now_;
  if (readings_.empty() && std::exchange(has_failed_, false)) loss_.raise();
  return count + loss_.read(into.subspan(count), now);
}

}  // namespace probebox::iio
