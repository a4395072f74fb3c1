#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "protocol/codec/inlined.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/frame/bytes.hpp"

// Packs residuals into bits and unpacks them: kernel bodies.
namespace probebox::codec {

template <std::size_t Width>
constexpr std::uint64_t kMask = Width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (Width % 64)) - 1;

template <std::size_t Width>
PROBEBOX_INLINE void pack(const std::int64_t* values, std::size_t groups, std::byte* into) {
  if constexpr (Width > 0) {
    for (std::size_t group = 0; group < groups; ++group) {
      std::array<std::uint64_t, (Width + 7) / 8> words{};
      [&]<std::size_t... K>(std::index_sequence<K...>) {
        (
            [&] {
              constexpr std::size_t kBit = K * Width;
              const std::uint64_t value = static_cast<std::uint64_t>(values[K]) & kMask<Width>;
              words[kBit / 64] |= value << (kBit % 64);
              if constexpr (kBit % 64 + Width > 64) words[kBit / 64 + 1] |= value >> (64 - kBit % 64);
            }(),
            ...);
      }
      (std::make_index_sequence<kGroup>{});
      for (std::size_t word = 0; word < words.size(); ++word) frame::storeLittle(words[word], into + 8 * word);
      values += kGroup;
      into += Width;
    }
  }
}

// Packs the low `Width` bits of the four 16-bit values in a word without gaps.
template <std::size_t Width>
PROBEBOX_INLINE std::uint64_t squeezed(std::uint64_t word) {
  constexpr std::uint64_t kLow = kMask<Width>;
  const std::uint64_t pairs = (word & (kLow | kLow << 32U)) | ((word >> (16 - Width)) & (kLow | kLow << 32U) << Width);
  return (pairs & kMask<2 * Width>) | (pairs >> (32 - 2 * Width) & kMask<2 * Width> << (2 * Width));
}

// Takes four values a word, the first in the lowest bits.
PROBEBOX_INLINE void loadFours(const std::int16_t* values, std::size_t words, std::uint64_t* into) {
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(into, values, words * sizeof *into);
  } else {
    for (std::size_t k = 0; k < 4 * words; ++k)
      into[k / 4] |= static_cast<std::uint64_t>(static_cast<std::uint16_t>(values[k])) << (16 * (k % 4));
  }
}

template <std::size_t Width, std::size_t Groups>
PROBEBOX_INLINE void packSomeNarrow(const std::int16_t* values, std::byte* into) {
  std::array<std::uint64_t, 2 * Groups> words{};
  loadFours(values, words.size(), words.data());
  for (auto& word : words) word = squeezed<Width>(word);
  for (std::size_t k = 0; k < Groups; ++k) {
    frame::storeLittle(words[2 * k] | words[2 * k + 1] << (4 * Width), into + k * Width);
    if constexpr (Width > 8) frame::storeLittle(words[2 * k + 1] >> (64 - 4 * Width), into + k * Width + 8);
  }
}

template <std::size_t Width>
PROBEBOX_INLINE void packNarrow(const std::int16_t* values, std::size_t groups, std::byte* into) {
  if constexpr (Width > 0) {
    constexpr std::size_t kSome = 4;
    for (; groups >= kSome; groups -= kSome, values += kSome * kGroup, into += kSome * Width)
      packSomeNarrow<Width, kSome>(values, into);
    for (; groups > 0; --groups, values += kGroup, into += Width) packSomeNarrow<Width, 1>(values, into);
  }
}

// Applies where four values and the preceding bits of their first byte fit into one word.
template <std::size_t Width>
PROBEBOX_INLINE void unpackNarrow(const std::byte* from, std::size_t groups, std::int64_t* values) {
  constexpr std::uint64_t kSign = std::uint64_t{1} << (Width - 1);
  for (std::size_t group = 0; group < groups; ++group) {
    for (std::size_t half = 0; half < 2; ++half) {
      const std::size_t bit = half * 4 * Width;
      const auto word = frame::loadLittle<std::uint64_t>(from + group * Width + bit / 8);
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint64_t bits = (word >> (bit % 8 + k * Width)) & kMask<Width>;
        values[group * kGroup + 4 * half + k] = static_cast<std::int64_t>((bits ^ kSign) - kSign);
      }
    }
  }
}

template <std::size_t Width>
PROBEBOX_INLINE void unpack(const std::byte* from, std::size_t groups, std::int64_t* values) {
  if constexpr (Width > 0 && Width <= kNarrowPacked) return unpackNarrow<Width>(from, groups, values);
  for (std::size_t group = 0; group < groups; ++group) {
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      (
          [&] {
            if constexpr (Width == 0) {
              values[K] = 0;
            } else {
              constexpr std::size_t kByte = K * Width / 8;
              constexpr std::size_t kShift = K * Width % 8;
              std::uint64_t bits = frame::loadLittle<std::uint64_t>(from + kByte) >> kShift;
              if constexpr (kShift + Width > 64)
                bits |= std::to_integer<std::uint64_t>(from[kByte + 8]) << (64 - kShift);
              values[K] = static_cast<std::int64_t>(bits << (64 - Width)) >> (64 - Width);
            }
          }(),
          ...);
    }
    (std::make_index_sequence<kGroup>{});
    from += Width;
    values += kGroup;
  }
}

}  // namespace probebox::codec
