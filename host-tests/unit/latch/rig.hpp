#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "firmware/latch/latch.hpp"

namespace probebox::latch_test {

inline constexpr std::int64_t kPeriodNs = 1'000'000;
inline constexpr std::int64_t kStartNs = 5'000'000'000;

// Ticks of exactly 1 ms, the first at kStartNs.
inline TickMap perfectMap(std::int64_t tick, ClockState state = ClockState::locked) {
  return {.tick = {tick},
          .at = monoTime(kStartNs + tick * kPeriodNs),
          .period_q32_ns = kPeriodNs << 32,
          .sigma_ns = 100,
          .state = state};
}

// What the sources see: ramps, so that linear interpolation is exact but for rounding.
inline std::int64_t rampNm(std::size_t channel, std::int64_t ns) {
  return static_cast<std::int64_t>(channel + 1) * (ns - kStartNs) / 1000;
}
inline std::int64_t rampCounts(std::size_t axis, std::int64_t ns) {
  return -static_cast<std::int64_t>(axis + 1) * (ns - kStartNs) / 500;
}

inline Deflection deflectionAt(std::int64_t ns, bool clipped = false) {
  Deflection d{.sequence = 0, .channels_nm = {}, .clipped = clipped, .at = monoTime(ns)};
  for (std::size_t i = 0; i < 3; ++i) d.channels_nm[i] = static_cast<std::int32_t>(rampNm(i, ns));
  return d;
}
inline Count countAt(Axis axis, std::int64_t ns) {
  return {.axis = axis, .sequence = 0, .counts = rampCounts(static_cast<std::size_t>(axis), ns), .at = monoTime(ns)};
}
inline Edge edgeAt(LineRole role, Level level, std::int64_t ns, std::uint8_t line = 0) {
  return {.role = role, .line = line, .level = level, .line_sequence = 0, .at = monoTime(ns)};
}

// Drains the latch and checks, on the way, that no index is skipped or repeated and that the counters add up.
class Harvest {
 public:
  void take(latch::Latch& latch) {
    while (const auto decision = latch.next()) {
      if (const auto* record = std::get_if<latch::Record>(&*decision)) {
        expect(record->index, 1);
        records.push_back(*record);
      } else {
        const auto& loss = std::get<latch::Lost>(*decision);
        expect(loss.first, loss.count);
        losses.push_back(loss);
      }
      const latch::LatchCounters& c = latch.counters();
      contiguous = contiguous && c.produced == c.records + c.lost && c.produced == decided_ &&
                   c.records == static_cast<std::int64_t>(records.size());
    }
  }

  std::int64_t lostFor(latch::LostReason reason) const {
    std::int64_t count = 0;
    for (const auto& loss : losses) count += loss.reason == reason ? loss.count : 0;
    return count;
  }

  std::vector<latch::Record> records;
  std::vector<latch::Lost> losses;
  bool contiguous{true};

 private:
  void expect(SampleIndex index, std::int64_t count) {
    contiguous = contiguous && count > 0 && (!next_ || *next_ == index);
    next_ = index + count;
    decided_ += count;
  }

  std::optional<SampleIndex> next_;
  std::int64_t decided_{};
};

}  // namespace probebox::latch_test
