#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

// Declares the inner loops of profile fast, in plain C++ and for each vector instruction set, selected at run time.
// Integers only: every kernel gives the same bits.
namespace probebox::codec {

inline constexpr std::size_t kMostOrder = 3;  // highest order of differences
inline constexpr std::size_t kTracking = 4;   // order number of the first tracking predictor
inline constexpr std::size_t kTrackings = 2;  // how many there are
inline constexpr std::size_t kGroup = 8;      // values packed together into `width` bytes
inline constexpr std::size_t kSlack = 8;      // bytes beyond a group that packing and unpacking may touch
inline constexpr std::size_t kStride = 32;    // residuals measured together; the last stride is padded with zeros

inline constexpr unsigned kNarrowBits = 16;       // residuals up to this width are processed in 16-bit lanes
inline constexpr std::size_t kNarrowPacked = 14;  // widths up to this are packed from 16-bit lanes
inline constexpr std::size_t kUntracked = 4;
inline constexpr std::size_t kTracked = 3;  // columns tracked side by side: each value depends on its predecessor

// Sums magnitudes: r where r >= 0, otherwise -1 - r. A residual needs one bit more than its magnitude.
struct Size {
  std::uint64_t sum{};   // of the magnitudes where each is below 2^47; all ones otherwise
  unsigned most_bits{};  // that a residual needs, sign included; 0 where all are 0
};

// Counts the residuals that need more than width, width + 1, width + 2 and width + 3 bits.
using WiderCounts = std::array<std::uint32_t, 4>;

struct Kernels {
  // Sums the magnitudes (as in Size) of the residuals of orders 0 to 3.
  std::array<std::uint64_t, kMostOrder + 1> (*survey)(const std::int64_t* x, std::size_t count);
  // Computes into[k], the residual of x[k] by that difference, from k = 0; the seeds precede x in memory.
  void (*residuals[kMostOrder + 1])(const std::int64_t* x, std::size_t count, std::int64_t* into);
  // Does so for the tracking predictors, one or more columns.
  void (*track[kTrackings][kTracked])(const std::int64_t* const* x, std::size_t count, std::int64_t* const* into);
  // The next five process whole strides. Also copies the low 16 bits of the residuals.
  Size (*size)(const std::int64_t* residuals, std::size_t count, std::int16_t* narrow);
  WiderCounts (*wider)(const std::int64_t* residuals, std::size_t count, unsigned width);
  WiderCounts (*narrow_wider)(const std::int16_t* residuals, std::size_t count, unsigned width);
  // Lists the positions of the residuals that need more than `width` bits, at most 65536.
  std::size_t (*places)(const std::int64_t* residuals, std::size_t count, unsigned width, std::uint16_t* into);
  std::size_t (*narrow_places)(const std::int16_t* residuals, std::size_t count, unsigned width, std::uint16_t* into);
  // Returns zero when all values plus bias are below 2^bits.
  std::uint64_t (*beyond)(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits);
  // Packs the low `width` bits of 8 x groups values, lowest bit first.
  void (*pack[65])(const std::int64_t* values, std::size_t groups, std::byte* into);
  void (*narrow_pack[kNarrowPacked + 1])(const std::int16_t* values, std::size_t groups, std::byte* into);
  // Unpacks them with sign extension.
  void (*unpack[65])(const std::byte* from, std::size_t groups, std::int64_t* values);
  // Replaces the residuals x[0], x[1] ... of that difference by values; the seeds precede x in memory.
  void (*integrate[kMostOrder + 1])(std::int64_t* x, std::size_t count);
  // The same for the tracking predictors, one or more columns.
  void (*untrack[kTrackings][kUntracked])(std::int64_t* const* x, std::size_t count);
};

}  // namespace probebox::codec
