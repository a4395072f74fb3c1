#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/clock/counter_clock.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/rates.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Arrays by role and number of a line.
inline constexpr std::size_t kLineRoles = 5;
inline constexpr std::size_t kLinesOfRole = 32;
template <class T>
using PerLine = std::array<std::array<T, kLinesOfRole>, kLineRoles>;

// Numbers of edges of one line. Once a later edge has arrived, each edge that the kernel saw is counted in exactly one
// of them.
struct LineCounters {
  std::uint64_t edges{};  // reached the core
  std::uint64_t lost{};   // by the gaps in the line's sequence
};

// Events (not samples) lost at their sources, from the gaps in the sources' own counters.
struct SourceLosses {
  std::uint64_t sync_edges{};
  std::uint64_t line_edges{};  // of trigger, index and skip lines
  std::uint64_t counts{};
  std::uint64_t deflections{};
  std::uint64_t queue_events{};
  std::uint64_t sources_gone{};  // number of times, not of events
};

// Estimated clock of a probe receiver relative to CLOCK_MONOTONIC; zeros before its first sample.
struct ProbeClock {
  ClockState state{};
  double offset_ppm{};
  double sigma_ns{};
  clock::CounterClockCounters counters;
};

// The published state of the box: plain data, replaced as a whole after every batch of events, read by links and
// registers.
struct State {
  MonoTime at{};
  published::Snapshot snapshot;
  TickMap map;
  ProbeClock probe_clock;
  ProbeClock control_clock;  // of positions that the controller sends
  procedure::Progress procedure;
  std::optional<procedure::Rates> rates;  // of the last second; nothing before its end or that of all sources
  bool delay_applied{true};               // false when the delay in force exceeds the buffer
  std::uint64_t events{};
  SourceLosses lost;
  PerLine<LineCounters> lines{};
};

}  // namespace probebox::box
