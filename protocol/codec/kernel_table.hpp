#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

// The inner loops of profile fast, in plain C++ and for each kind of vector unit, selected at run time. Integers only:
// all give the same bits.
namespace probebox::codec {

inline constexpr std::size_t kMostOrder = 3;  // of differences
inline constexpr std::size_t kTracking = 4;   // the predictor after them
inline constexpr std::size_t kGroup = 8;      // values that packing takes at once; `width` bytes when packed
inline constexpr std::size_t kSlack = 8;      // bytes beyond a group that packing and unpacking may touch
inline constexpr std::size_t kStride = 32;    // residuals that are judged at once: zeros fill their number up to that

inline constexpr unsigned kNarrowBits = 16;  // residuals of at most so many bits are worked on in lanes of that size
inline constexpr std::size_t kNarrowPacked = 14;  // widths that are packed from there
inline constexpr std::size_t kUntracked = 4;
inline constexpr std::size_t kTracked = 3;  // columns that tracking takes at once: one value waits for the one before

// A residual's magnitude is r where r is not negative, -1 - r elsewhere: r needs one bit more than that.
struct Size {
  std::uint64_t sum{};   // of the magnitudes where each is below 2^47; all ones otherwise
  unsigned most_bits{};  // that a residual needs, sign included; 0 where all are 0
};

// Residuals that need more than width, width + 1, width + 2 and width + 3 bits.
using WiderCounts = std::array<std::uint32_t, 4>;

struct Kernels {
  // Sums as in Size of the residuals of orders 0 to 3.
  std::array<std::uint64_t, kMostOrder + 1> (*survey)(const std::int64_t* x, std::size_t count);
  // into[k]: residual of x[k], for k from 0, of that difference; x has as many values before it as it has seeds.
  void (*residuals[kMostOrder + 1])(const std::int64_t* x, std::size_t count, std::int64_t* into);
  // The same of the predictor that tracks, of one column and more.
  void (*track[kTracked])(const std::int64_t* const* x, std::size_t count, std::int64_t* const* into);
  // The next five go on to a whole stride. And the residuals' low 16 bits.
  Size (*size)(const std::int64_t* residuals, std::size_t count, std::int16_t* narrow);
  WiderCounts (*wider)(const std::int64_t* residuals, std::size_t count, unsigned width);
  WiderCounts (*narrow_wider)(const std::int16_t* residuals, std::size_t count, unsigned width);
  // The positions of the residuals that need more than `width` bits, at most 64 k.
  std::size_t (*places)(const std::int64_t* residuals, std::size_t count, unsigned width, std::uint16_t* into);
  std::size_t (*narrow_places)(const std::int16_t* residuals, std::size_t count, unsigned width, std::uint16_t* into);
  // Zero when all values plus bias are below 2^bits.
  std::uint64_t (*beyond)(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits);
  // Low `width` bits of 8 x groups values, value after value from the lowest bit on.
  void (*pack[65])(const std::int64_t* values, std::size_t groups, std::byte* into);
  void (*narrow_pack[kNarrowPacked + 1])(const std::int16_t* values, std::size_t groups, std::byte* into);
  // The same back, with the sign.
  void (*unpack[65])(const std::byte* from, std::size_t groups, std::int64_t* values);
  // x[0], x[1] ... are residuals of that difference and become values; its seeds stand before them.
  void (*integrate[kMostOrder + 1])(std::int64_t* x, std::size_t count);
  // The same of the predictor that tracks, of one column and more.
  void (*untrack[kUntracked])(std::int64_t* const* x, std::size_t count);
};

}  // namespace probebox::codec
