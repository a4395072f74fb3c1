#pragma once
#include <algorithm>
#include <cstdint>
#include <limits>
#include <rapidcheck.h>
#include <vector>

#include "protocol/codec/block.hpp"

// Integer channels of every kind.
namespace probebox::codec {

using Values = std::vector<std::int64_t>;

struct Range {
  std::int64_t low{};
  std::int64_t high{};
};

inline Range rangeOf(ChannelFormat format) {
  if (format.bytes == 8)
    return {format.is_signed ? std::numeric_limits<std::int64_t>::min() : 0, std::numeric_limits<std::int64_t>::max()};
  const std::int64_t span = std::int64_t{1} << (8 * format.bytes);
  return format.is_signed ? Range{-span / 2, span / 2 - 1} : Range{0, span - 1};
}

inline rc::Gen<ChannelFormat> anyFormat() {
  return rc::gen::apply(
      [](std::uint8_t bytes, bool is_signed) {
        return ChannelFormat{bytes, is_signed};
      },
      rc::gen::element<std::uint8_t>(1, 2, 4, 8), rc::gen::arbitrary<bool>());
}

inline std::int64_t anyValue(ChannelFormat format) {
  const auto [low, high] = rangeOf(format);
  const auto wild = *rc::gen::arbitrary<std::int64_t>();
  switch (*rc::gen::inRange(0, 3)) {
    case 0:
      return low;
    case 1:
      return high;
    default:
      return std::clamp(wild, low, high);
  }
}

// What channels do: jump anywhere, stand still, wander, move evenly with noise, and be silent but for some outliers.
inline Values anyColumn(ChannelFormat format, std::size_t count) {
  const auto kind = *rc::gen::inRange(0, 5);
  const auto start = anyValue(format);
  const auto step = *rc::gen::inRange<std::int64_t>(-300, 300);
  const auto noise = *rc::gen::inRange<std::int64_t>(1, 100);
  const auto [low, high] = rangeOf(format);
  Values column;
  std::uint64_t state = *rc::gen::arbitrary<std::uint64_t>();
  const auto random = [&state](std::int64_t below) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::int64_t>((state >> 33U) % static_cast<std::uint64_t>(below));
  };
  auto place = static_cast<std::uint64_t>(start);
  for (std::size_t k = 0; k < count; ++k) {
    if (kind == 0) place = static_cast<std::uint64_t>(anyValue(format));
    if (kind == 2) place += static_cast<std::uint64_t>(random(2 * noise) - noise);
    if (kind == 3) place += static_cast<std::uint64_t>(step + random(noise));
    if (kind == 4 && random(40) == 0) place = static_cast<std::uint64_t>(anyValue(format));
    column.push_back(std::clamp(static_cast<std::int64_t>(place), low, high));
  }
  return column;
}

}  // namespace probebox::codec
