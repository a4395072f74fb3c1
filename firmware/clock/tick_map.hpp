#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

// Arithmetic on a TickMap in integers only: a sample index maps to the same nanosecond on every machine.
namespace probebox::clock {

// Time of a tick.
MonoTime timeOf(const TickMap& map, Tick tick);

// Time of a sample. samples_per_tick: 1 to 100.
MonoTime timeOf(const TickMap& map, SampleIndex sample, std::int32_t samples_per_tick);

// Master time of a stamp: tick index * nominal period, linear between ticks.
MasterTime masterTimeOf(const TickMap& map, MonoTime at, Nanoseconds nominal_period);

// Last tick, or sample, not after `at`.
Tick tickBefore(const TickMap& map, MonoTime at);
SampleIndex sampleBefore(const TickMap& map, MonoTime at, std::int32_t samples_per_tick);

// Fraction of a tick since tickBefore(), in 2^-32 tick.
std::uint32_t phaseQ32(const TickMap& map, MonoTime at);

}  // namespace probebox::clock
