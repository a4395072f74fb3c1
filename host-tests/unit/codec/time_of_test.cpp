#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck.h>

#include "protocol/codec/block.hpp"

namespace probebox::codec {
namespace {

BlockHeader header(std::int64_t tick, std::int64_t at_ns, double period_ns, std::uint16_t samples_per_tick) {
  return {.samples_per_tick = samples_per_tick,
          .map = {.tick = {tick},
                  .at = monoTime(at_ns),
                  .period_q32_ns = static_cast<std::int64_t>(std::ldexp(period_ns, 32))}};
}

TEST(TimeOf, IsTheMapsStampAtItsTick) {
  EXPECT_EQ(timeOf(header(1000, 5'000'000'000, 1e6, 4), {4000}), monoTime(5'000'000'000));
}

TEST(TimeOf, AgreesWithRealArithmetic) {
  EXPECT_TRUE(rc::check("within 1 ns of long double", [] {
    const auto tick = *rc::gen::inRange<std::int64_t>(0, 1'000'000'000);
    const auto offset = *rc::gen::inRange<std::int64_t>(-100'000, 100'000);
    const auto samples_per_tick = *rc::gen::inRange<std::uint16_t>(1, 101);
    const auto period = 1e5 + *rc::gen::inRange(0, 1'000'000) + 0.25;
    const auto block = header(tick, 7'000'000'000, period, samples_per_tick);
    const auto got = toNs(timeOf(block, {tick * samples_per_tick + offset}));
    const long double expected = 7e9L + static_cast<long double>(offset) * period / samples_per_tick;
    RC_ASSERT(std::abs(static_cast<long double>(got) - expected) <= 1.0L);
  }));
}

TEST(TimeOf, NeverGoesBack) {
  const auto block = header(10, 1'000, 3.3, 7);
  for (std::int64_t k = 0; k < 200; ++k) EXPECT_LE(timeOf(block, {k}), timeOf(block, {k + 1})) << k;
}

TEST(TimeOf, OfNonsenseIsNonsenseButNoOverflow) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  BlockHeader block{.samples_per_tick = 0, .map = {.tick = {kMost}, .at = monoTime(kMost), .period_q32_ns = kMost}};
  EXPECT_LE(timeOf(block, {-kMost}), timeOf(block, {kMost}));
}

}  // namespace
}  // namespace probebox::codec
