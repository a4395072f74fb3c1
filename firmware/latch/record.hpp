#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <variant>

#include "protocol/units/time.hpp"

namespace probebox::latch {

// Columns of a record in their order. Integers only.
enum class Channel : std::size_t { d1 = 0, d2 = 1, d3 = 2, x = 3, y = 4, z = 5, flags = 6 };
inline constexpr std::size_t kChannels = 7;

// Bits of Channel::flags. "Since the previous record" includes the time of lost samples in between.
namespace flag {
inline constexpr std::int64_t kHoldover = 1 << 0;    // the tick is predicted: no sync edge for a while
inline constexpr std::int64_t kTrigger = 1 << 1;     // a trigger line became active since the previous record
inline constexpr std::int64_t kTouch = 1 << 2;       // a trigger line was active at the sample's time: in contact
inline constexpr std::int64_t kSkip = 1 << 3;        // the skip line was active at the sample's time
inline constexpr std::int64_t kClipped = 1 << 4;     // the probe was at the end of its range in an interpolated value
inline constexpr std::int64_t kStep = 1 << 5;        // a marker step was running
inline constexpr std::int64_t kIndexPulse = 1 << 6;  // an axis passed its index pulse since the previous record
}  // namespace flag

// One sample: all sources interpolated at the same instant.
struct Record {
  SampleIndex index{};
  std::array<std::int64_t, kChannels> values{};  // d1 d2 d3: nm; x y z: counts; flags

  constexpr std::int64_t operator[](Channel channel) const { return values[static_cast<std::size_t>(channel)]; }
};

enum class LostReason : std::uint8_t {
  clock = 0,     // the master clock was ambiguous or not locked: the time of these samples is unknown
  probe = 1,     // no two deflections close enough around the sample's time
  encoders = 2,  // no counts of some axis close enough to the sample's time
};

// Indices of samples without a record.
struct Lost {
  SampleIndex first{};
  std::int64_t count{};
  LostReason reason{};
};

using Decision = std::variant<Record, Lost>;

}  // namespace probebox::latch
