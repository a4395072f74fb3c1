#include "firmware/clock/tick_map.hpp"

namespace probebox::clock {
namespace {

__extension__ using Wide = __int128;

// Rounds towards minus infinity, so that times before the anchor behave like those after it.
constexpr std::int64_t floorDivide(Wide numerator, Wide denominator) {
  const auto narrow = static_cast<std::int64_t>(numerator), by = static_cast<std::int64_t>(denominator);
  if (narrow == numerator && by == denominator) return narrow / by - (narrow % by < 0 ? 1 : 0);
  const Wide quotient = numerator / denominator;
  return static_cast<std::int64_t>(quotient - (numerator % denominator < 0 ? 1 : 0));
}

constexpr Wide kOneNs = Wide{1} << 32;

Wide elapsedQ32(const TickMap& map, MonoTime at) {
  return static_cast<Wide>(toNs(at) - toNs(map.at)) * kOneNs;
}

}  // namespace

MonoTime timeOf(const TickMap& map, Tick tick) {
  return timeOf(map, SampleIndex{tick.index}, 1);
}

MonoTime timeOf(const TickMap& map, SampleIndex sample, std::int32_t samples_per_tick) {
  const Wide steps = sample.index - static_cast<Wide>(map.tick.index) * samples_per_tick;
  const Wide half = kOneNs * samples_per_tick / 2;
  return map.at + Nanoseconds{floorDivide((steps * map.period_q32_ns + half) >> 32, samples_per_tick)};
}

MasterTime masterTimeOf(const TickMap& map, MonoTime at, Nanoseconds nominal_period) {
  const Wide scaled = elapsedQ32(map, at) * nominal_period.count() + map.period_q32_ns / 2;
  return masterTime(map.tick, nominal_period) + Nanoseconds{floorDivide(scaled, map.period_q32_ns)};
}

Tick tickBefore(const TickMap& map, MonoTime at) {
  return {sampleBefore(map, at, 1).index};
}

SampleIndex sampleBefore(const TickMap& map, MonoTime at, std::int32_t samples_per_tick) {
  // timeOf() rounds to whole nanoseconds; half of one on top makes the two agree on a sample's own time.
  const Wide elapsed = elapsedQ32(map, at) + kOneNs / 2;
  return {map.tick.index * samples_per_tick + floorDivide(elapsed * samples_per_tick, map.period_q32_ns)};
}

std::uint32_t phaseQ32(const TickMap& map, MonoTime at) {
  const Wide since =
      elapsedQ32(map, at) - static_cast<Wide>(tickBefore(map, at).index - map.tick.index) * map.period_q32_ns;
  // tickBefore() rounds by half a nanosecond: just before a tick the phase is 0 of it.
  const Wide phase = since <= 0 ? 0 : since * kOneNs / map.period_q32_ns;
  return static_cast<std::uint32_t>(phase < kOneNs ? phase : kOneNs - 1);
}

}  // namespace probebox::clock
