#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

// Arithmetic on a TickMap. Integers only: a sample index becomes the same nanosecond on every machine.
namespace probebox::clock {

// When a tick was (or will be).
MonoTime timeOf(const TickMap& map, Tick tick);

// When a sample was. samples_per_tick: 1 to 100.
MonoTime timeOf(const TickMap& map, SampleIndex sample, std::int32_t samples_per_tick);

// A stamp on the master clock: tick index times nominal period, continued linearly between ticks.
MasterTime masterTimeOf(const TickMap& map, MonoTime at, Nanoseconds nominal_period);

// The last tick, or sample, that is not after `at`.
Tick tickBefore(const TickMap& map, MonoTime at);
SampleIndex sampleBefore(const TickMap& map, MonoTime at, std::int32_t samples_per_tick);

// What has passed at `at` since tickBefore(), in 2^-32 of a tick.
std::uint32_t phaseQ32(const TickMap& map, MonoTime at);

}  // namespace probebox::clock
