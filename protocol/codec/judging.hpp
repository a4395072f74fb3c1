#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "protocol/codec/format.hpp"
#include "protocol/codec/inlined.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/codec/prediction.hpp"
#include "protocol/frame/bytes.hpp"

// Measures the magnitudes of values and residuals: kernel bodies.
namespace probebox::codec {

template <std::signed_integral T>
PROBEBOX_INLINE T magnitude(T residual) {
  return static_cast<T>(residual ^ (residual >> (8 * sizeof(T) - 1)));
}

// Returns all ones where a sum of magnitudes could overflow.
PROBEBOX_INLINE std::uint64_t soundSum(std::uint64_t sum, std::uint64_t all) {
  return all >> 47U == 0 ? sum : ~std::uint64_t{0};
}

PROBEBOX_INLINE std::array<std::uint64_t, kMostOrder + 1> survey(const std::int64_t* x, std::size_t count) {
  std::array<std::uint64_t, kMostOrder + 1> sums{};
  std::array<std::uint64_t, kMostOrder + 1> all{};
  for (std::size_t k = kMostOrder; k < count; ++k) {
    const auto of = [&](std::uint64_t residual) {
      return static_cast<std::uint64_t>(magnitude(static_cast<std::int64_t>(residual)));
    };
    const std::array<std::uint64_t, kMostOrder + 1> of_k{of(residual<0>(x + k)), of(residual<1>(x + k)),
                                                         of(residual<2>(x + k)), of(residual<3>(x + k))};
    for (std::size_t order = 0; order < of_k.size(); ++order) {
      sums[order] += of_k[order];
      all[order] |= of_k[order];
    }
  }
  for (std::size_t order = 0; order < sums.size(); ++order) sums[order] = soundSum(sums[order], all[order]);
  return sums;
}

constexpr std::size_t wholeStrides(std::size_t count) {
  return (count + kStride - 1) / kStride * kStride;
}

PROBEBOX_INLINE Size size(const std::int64_t* residuals, std::size_t count, std::int16_t* narrow) {
  count = wholeStrides(count);
  std::uint64_t sum = 0;
  std::uint64_t all = 0;
  std::int64_t any = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto size = static_cast<std::uint64_t>(magnitude(residuals[k]));
    sum += size;
    all |= size;
    any |= residuals[k];
  }
  for (std::size_t k = 0; k < count; ++k) narrow[k] = static_cast<std::int16_t>(residuals[k]);
  return {soundSum(sum, all), any == 0 ? 0U : static_cast<unsigned>(std::bit_width(all)) + 1};
}

// A residual needs more than w bits when its magnitude exceeds this. Width 0 is special: any value but 0 exceeds it.
template <std::signed_integral T>
PROBEBOX_INLINE T mostOf(unsigned width) {
  return static_cast<T>(((std::uint64_t{1} << std::min<std::size_t>(width, 8 * sizeof(T) - 1)) - 1) >> 1U);
}

template <std::signed_integral T>
PROBEBOX_INLINE WiderCounts wider(const T* residuals, std::size_t count, unsigned width) {
  using Count = std::make_unsigned_t<T>;  // a counter for each lane
  const std::array<T, 4> limits{mostOf<T>(width), mostOf<T>(width + 1), mostOf<T>(width + 2), mostOf<T>(width + 3)};
  std::array<Count, 4> counts{};
  count = wholeStrides(count);
  for (std::size_t k = 0; k < count; ++k) {
    const T size = magnitude(residuals[k]);
    for (std::size_t j = 0; j < limits.size(); ++j)
      counts[j] = static_cast<Count>(counts[j] + (size > limits[j] ? 1U : 0U));
  }
  if (width == 0) {
    counts[0] = 0;
    for (std::size_t k = 0; k < count; ++k) counts[0] = static_cast<Count>(counts[0] + (residuals[k] != 0 ? 1U : 0U));
  }
  return {static_cast<std::uint32_t>(counts[0]), static_cast<std::uint32_t>(counts[1]),
          static_cast<std::uint32_t>(counts[2]), static_cast<std::uint32_t>(counts[3])};
}

// Tests eight flags at a time: most words are zero.
template <std::signed_integral T>
PROBEBOX_INLINE std::size_t places(const T* residuals, std::size_t count, unsigned width, std::uint16_t* into) {
  const T limit = mostOf<T>(width);
  count = wholeStrides(count);
  std::array<std::byte, kMostFastSamples> is_wider;
  if (width == 0) {
    for (std::size_t k = 0; k < count; ++k) is_wider[k] = static_cast<std::byte>(residuals[k] != 0 ? 1 : 0);
  } else {
    for (std::size_t k = 0; k < count; ++k)
      is_wider[k] = static_cast<std::byte>(magnitude(residuals[k]) > limit ? 1 : 0);
  }
  std::size_t found = 0;
  for (std::size_t eight = 0; eight < count; eight += 8) {
    for (auto word = frame::loadLittle<std::uint64_t>(&is_wider[eight]); word != 0; word &= word - 1)
      into[found++] = static_cast<std::uint16_t>(eight + static_cast<unsigned>(std::countr_zero(word)) / 8);
  }
  return found;
}

PROBEBOX_INLINE std::uint64_t beyond(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits) {
  std::uint64_t all = 0;
  for (std::size_t k = 0; k < count; ++k) all |= (static_cast<std::uint64_t>(x[k]) + bias) >> bits;
  return all;
}

}  // namespace probebox::codec
