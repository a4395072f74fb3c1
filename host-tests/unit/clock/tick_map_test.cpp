#include "firmware/clock/tick_map.hpp"

#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <rapidcheck.h>

namespace probebox::clock {
namespace {

constexpr double kQ32 = 4294967296.0;

TickMap anyMap() {
  const auto period_ns = *rc::gen::inRange<std::int64_t>(100'000, 10'000'000);
  const auto fraction = *rc::gen::inRange<std::int64_t>(0, std::int64_t{1} << 32);
  return {.tick = {*rc::gen::inRange<std::int64_t>(0, std::int64_t{1} << 39)},  // 174 years of ticks of 10 ms
          .at = monoTime(*rc::gen::inRange<std::int64_t>(0, std::int64_t{1} << 60)),
          .period_q32_ns = (period_ns << 32) + fraction};
}

void holds(const char* what, const std::function<void()>& property) {
  EXPECT_TRUE(rc::check(what, property));
}

TEST(TickMapArithmetic, AgreesWithLongDouble) {
  holds("time of a sample", [] {
    const TickMap map = anyMap();
    const auto per_tick = *rc::gen::inRange<std::int32_t>(1, 101);
    const auto steps = *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000);
    const SampleIndex sample{map.tick.index * per_tick + steps};
    const long double expected =
        static_cast<long double>(steps) * static_cast<long double>(map.period_q32_ns) / kQ32 / per_tick;
    const auto got = static_cast<long double>((timeOf(map, sample, per_tick) - map.at).count());
    RC_ASSERT(std::abs(got - expected) <= 0.5L + 1e-6L);
  });
}

TEST(TickMapArithmetic, ASampleIsTheLastOneBeforeItsOwnTime) {
  holds("sampleBefore(timeOf(s)) == s", [] {
    const TickMap map = anyMap();
    const auto per_tick = *rc::gen::inRange<std::int32_t>(1, 101);
    const SampleIndex sample{map.tick.index * per_tick + *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000)};
    const MonoTime at = timeOf(map, sample, per_tick);
    RC_ASSERT(sampleBefore(map, at, per_tick) == sample);
    RC_ASSERT(sampleBefore(map, at - Nanoseconds{2}, per_tick) == sample + -1);
  });
}

TEST(TickMapArithmetic, ThePhaseIsTheShareOfThePeriodSinceTheTickBefore) {
  holds("phaseQ32", [] {
    const TickMap map = anyMap();
    const Tick tick = map.tick + *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000);
    const auto since_ns = *rc::gen::inRange<std::int64_t>(1, (map.period_q32_ns >> 32) - 1);
    const auto expected = static_cast<double>(since_ns) / (static_cast<double>(map.period_q32_ns) / kQ32);
    const auto phase = static_cast<double>(phaseQ32(map, timeOf(map, tick) + Nanoseconds{since_ns})) / kQ32;
    // timeOf() rounds to whole nanoseconds, in 100 us at least.
    RC_ASSERT(std::abs(phase - expected) < 1e-5);
  });
}

TEST(TickMapArithmetic, MasterTimeOfATickIsItsIndexTimesTheNominalPeriod) {
  holds("masterTimeOf(timeOf(tick)) == tick * nominal", [] {
    const TickMap map = anyMap();
    const Nanoseconds nominal{*rc::gen::inRange<std::int64_t>(100'000, 10'000'000)};
    const Tick tick = map.tick + *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'000);
    const Nanoseconds off = masterTimeOf(map, timeOf(map, tick), nominal) - masterTime(tick, nominal);
    // A nanosecond of rounding, seen through the ratio of the periods.
    RC_ASSERT(std::abs(off.count()) <= 1 + nominal.count() / (map.period_q32_ns >> 32));
  });
}

}  // namespace
}  // namespace probebox::clock
