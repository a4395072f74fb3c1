#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/clock/counter_clock.hpp"
#include "firmware/clock/estimator.hpp"
#include "firmware/latch/latch.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/published/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Lines by role and number.
inline constexpr std::size_t kLineRoles = 5;
inline constexpr std::size_t kLinesOfRole = 32;
template <class T>
using PerLine = std::array<std::array<T, kLinesOfRole>, kLineRoles>;

// Every edge that the kernel saw on a line is one of these, once a later one has come.
struct LineCounters {
  std::uint64_t edges{};  // reached the core
  std::uint64_t lost{};   // by the gaps in the line's sequence
};

// What the sources themselves lost, by the gaps in their own counters. Events, not samples.
struct SourceLosses {
  std::uint64_t sync_edges{};
  std::uint64_t line_edges{};  // of trigger, index and skip lines
  std::uint64_t counts{};
  std::uint64_t deflections{};
  std::uint64_t queue_events{};
  std::uint64_t sources_gone{};  // times, not events
};

// The sample counter of a probe receiver on the monotonic clock; zeros while none has sent a sample.
struct ProbeClock {
  ClockState state{};
  double offset_ppm{};
  double sigma_ns{};
  clock::CounterClockCounters counters;
};

// Where the box stands: plain, published whole after every event batch, read by links and registers.
struct State {
  MonoTime at{};
  published::Snapshot snapshot;
  TickMap map;
  double clock_offset_ppm{};
  clock::ClockCounters clock;
  ProbeClock probe_clock;
  latch::LatchCounters latch;
  procedure::Progress procedure;
  bool delay_applied{true};  // the delay in force is in the samples; one that no buffer spans is not
  std::uint64_t incomplete_rows{};
  std::uint64_t stray_markers{};
  std::uint64_t events{};
  SourceLosses lost;
  PerLine<LineCounters> lines{};
};

}  // namespace probebox::box
