#pragma once
#include <chrono>
#include <compare>
#include <cstdint>

namespace probebox {

// Time types of the box. None of these clocks has a now(): the core receives time as data.

// The kernel's CLOCK_MONOTONIC of one boot.
struct MonotonicClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MonotonicClock>;
  static constexpr bool is_steady = true;
};
using MonoTime = MonotonicClock::time_point;

// The master clock: tick index * nominal period.
struct MasterClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MasterClock>;
  static constexpr bool is_steady = true;
};
using MasterTime = MasterClock::time_point;

using Nanoseconds = std::chrono::nanoseconds;

constexpr MonoTime monoTime(std::int64_t ns) {
  return MonoTime{Nanoseconds{ns}};
}
constexpr std::int64_t toNs(MonoTime time) {
  return time.time_since_epoch().count();
}
constexpr MasterTime masterTime(std::int64_t ns) {
  return MasterTime{Nanoseconds{ns}};
}
constexpr std::int64_t toNs(MasterTime time) {
  return time.time_since_epoch().count();
}
constexpr double toSeconds(Nanoseconds duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

// Index of an edge of the master clock. Exact.
struct Tick {
  std::int64_t index{};

  friend constexpr auto operator<=>(Tick, Tick) = default;
  friend constexpr Tick operator+(Tick tick, std::int64_t count) { return {tick.index + count}; }
  friend constexpr std::int64_t operator-(Tick a, Tick b) { return a.index - b.index; }
};

constexpr MasterTime masterTime(Tick tick, Nanoseconds nominal_period) {
  return MasterTime{tick.index * nominal_period};
}

// Index of a sample: tick * samples per tick + sub-sample.
struct SampleIndex {
  std::int64_t index{};

  friend constexpr auto operator<=>(SampleIndex, SampleIndex) = default;
  friend constexpr SampleIndex operator+(SampleIndex sample, std::int64_t count) { return {sample.index + count}; }
  friend constexpr std::int64_t operator-(SampleIndex a, SampleIndex b) { return a.index - b.index; }
};

// A device's own counter. Only firmware/clock converts it to master time.
template <class Device>
struct DeviceTime {
  std::int64_t count{};
  friend constexpr auto operator<=>(DeviceTime, DeviceTime) = default;
};

// States of the master clock, as in clock servos. Samples exist only in `locked` and `holdover`.
enum class ClockState : std::uint8_t { unlocked = 0, locked = 1, holdover = 2, ambiguous = 3 };

// Time of a tick and present length of ticks, in integers, so that a sample index gives the same time on every machine.
struct TickMap {
  Tick tick{};
  MonoTime at{};
  std::int64_t period_q32_ns{};  // 2^-32 ns
  std::uint32_t sigma_ns{};
  ClockState state{};
  std::uint32_t holdover_ms{};
  static constexpr void fields(auto& self, auto&& field) {
    field("tick", self.tick, "the tick that the map is anchored to");
    field("at", self.at, "ns, monotonic, of this boot: when that tick was");
    field("period_q32_ns", self.period_q32_ns, "2^-32 ns, the period of the master clock now, on the monotonic clock");
    field("sigma_ns", self.sigma_ns, "ns, standard deviation (k = 1) of `at`");
    field("state", self.state, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("holdover_ms", self.holdover_ms, "ms since the last accepted sync edge");
  }
};

}  // namespace probebox
