#pragma once
#include <chrono>
#include <compare>
#include <cstdint>

namespace probebox {

// None of these clocks has a now(): time is given to the core, never asked for.

// The kernel's CLOCK_MONOTONIC, of one boot.
struct MonotonicClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MonotonicClock>;
  static constexpr bool is_steady = true;
};
using MonoTime = MonotonicClock::time_point;

// The master clock: tick index times nominal period.
struct MasterClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MasterClock>;
  static constexpr bool is_steady = true;
};
using MasterTime = MasterClock::time_point;

using Nanoseconds = std::chrono::nanoseconds;

constexpr MonoTime monoTime(std::int64_t ns) { return MonoTime{Nanoseconds{ns}}; }
constexpr std::int64_t toNs(MonoTime time) { return time.time_since_epoch().count(); }
constexpr MasterTime masterTime(std::int64_t ns) { return MasterTime{Nanoseconds{ns}}; }
constexpr std::int64_t toNs(MasterTime time) { return time.time_since_epoch().count(); }
constexpr double toSeconds(Nanoseconds duration) { return static_cast<double>(duration.count()) * 1e-9; }

// Index of an edge of the master clock. Exact.
struct Tick {
  std::int64_t index{};

  friend constexpr auto operator<=>(Tick, Tick) = default;
  friend constexpr Tick operator+(Tick tick, std::int64_t count) { return {tick.index + count}; }
  friend constexpr std::int64_t operator-(Tick a, Tick b) { return a.index - b.index; }
};

constexpr MasterTime masterTime(Tick tick, Nanoseconds nominal_period) { return MasterTime{tick.index * nominal_period}; }

// Index of a sample: tick times samples per tick, plus the sub-sample.
struct SampleIndex {
  std::int64_t index{};

  friend constexpr auto operator<=>(SampleIndex, SampleIndex) = default;
  friend constexpr SampleIndex operator+(SampleIndex sample, std::int64_t count) { return {sample.index + count}; }
  friend constexpr std::int64_t operator-(SampleIndex a, SampleIndex b) { return a.index - b.index; }
};

// A device's own counter, in its own counts. Only clock turns it into master time.
template <class Device>
struct DeviceTime {
  std::int64_t count{};
  friend constexpr auto operator<=>(DeviceTime, DeviceTime) = default;
};

}  // namespace probebox
