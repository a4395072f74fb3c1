#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/codec/format.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/frame/bytes.hpp"

// Codes one column of profile fast: residuals of a predictor, packed in the width that nearly all of them fit.
// Residuals that need more bits follow as exceptions.
//
//   per channel {u8 order, + 0x80 with exceptions; u8 width}
//   column: seeds | residuals, `width` bits each, two's complement, value after value from the lowest bit of the first
//   byte on, the last byte filled up with zeros | exceptions
//   order: 0 to 3, that difference, with as many seeds; 4 and 5, tracking (prediction.hpp), with 3 seeds
//   seed j: the j-th difference at sample j, as zigzag varint (0, -1, 1, -2 ... as 0, 1, 2, 3 ...; 7 bits a byte,
//   lowest first, 0x80 where more follow)
//   exceptions: their number, u8 bits of a high part, then their positions, then their high parts, packed as residuals
//   are: the residual is high part x 2^width + its `width` bits. Number and positions (of residuals, from 0) are u8 for
//   a column of at most 256 residuals, else u16.
//
// Order 0 with width 8 x bytes of the channel and no exceptions is a column of profile raw.
namespace probebox::codec {

constexpr std::size_t seedsOf(std::size_t order) {
  return order >= kTracking ? kMostOrder : order;
}

// Describes how a column is coded.
struct FastPlan {
  std::uint8_t order{};
  std::uint8_t width{};
  std::uint32_t exceptions{};
  std::uint8_t high_bits{};  // of an exception
  std::size_t bytes{};       // of the column, seeds and exceptions included

  std::uint8_t orderByte() const { return static_cast<std::uint8_t>(order | (exceptions > 0 ? 0x80U : 0U)); }
  bool isRaw(ChannelFormat format) const { return order == 0 && exceptions == 0 && width == 8 * format.bytes; }
};

// Encodes the columns of a block, several at a time, in preallocated memory.
class FastColumnEncoder {
 public:
  explicit FastColumnEncoder(const Kernels& kernels) : kernels_{kernels} {}

  struct Column {
    ChannelFormat format{};
    std::span<const std::int64_t> values;
  };

  // Chooses the shortest of the tried codings, never longer than raw. Takes at most kTracked columns of equal length,
  // of at most kMostFastSamples values; every value must fit its channel.
  void plan(std::span<const Column> columns);
  const FastPlan& planOf(std::size_t column) const { return works_[column].plan; }

  // Writes a planned column. The writer must have room for planOf().bytes bytes.
  void put(frame::ByteWriter& writer, std::size_t column);

 private:
  // Holds the working data of one column.
  struct Work {
    Column column;
    FastPlan plan{};
    std::uint8_t order{};       // as tried
    std::uint64_t mean{};       // magnitude of the residuals of that difference, where surveyed
    std::size_t seeds_bytes{};  // of that order
    Size size{};                // of the residuals
    std::array<std::int64_t, kMostFastSamples> residuals;  // then zeros up to a whole stride
    std::array<std::int16_t, kMostFastSamples> narrow;     // the same, as far as they are narrow

    bool isNarrow() const { return size.most_bits <= kNarrowBits; }
  };

  void survey(Work& work) const;
  void track(std::size_t predictor, std::size_t least_order, std::size_t columns);
  void subtract(Work& work) const;
  void judge(Work& work, std::size_t count) const;
  void planOne(Work& work) const;
  void chooseWidth(Work& work, std::size_t count) const;
  bool considerFrom(Work& work, std::size_t count, unsigned width) const;
  static void consider(Work& work, std::size_t count, unsigned width, std::size_t exceptions);
  void pack(const Work& work, std::span<std::byte> into, std::size_t room, std::size_t count) const;
  void putExceptions(const Work& work, frame::ByteWriter& writer, std::size_t count);

  const Kernels& kernels_;
  std::array<Work, kTracked> works_;
  std::array<std::uint16_t, kMostFastSamples> places_;
  std::array<std::int64_t, kMostFastSamples> highs_;
};

// Decodes the columns of a block, all of equal length.
class FastColumnDecoder {
 public:
  explicit FastColumnDecoder(const Kernels& kernels) : kernels_{kernels} {}

  // Decodes a column, or defers it until several can be decoded at once. order, width: the two bytes of the channel
  // list. The reader fails when bytes are missing.
  void get(frame::ByteReader& reader, std::size_t channel, ChannelFormat format, std::uint8_t order, std::uint8_t width,
           std::span<std::int64_t> column);
  // Decodes the columns that were deferred.
  void finish() {
    for (std::size_t k = 0; k < kTrackings; ++k) finish(k);
  }

  // Returns the channel whose column is invalid or holds a value outside its range.
  std::optional<std::size_t> bad() const { return bad_; }

 private:
  struct Held {
    std::size_t channel{};
    ChannelFormat format{};
    std::span<std::int64_t> column;
  };

  struct Waiting {
    std::array<Held, kUntracked> columns{};
    std::size_t count{};
  };

  void finish(std::size_t tracking);
  bool read(frame::ByteReader& reader, const Held& held, std::uint8_t order, std::uint8_t width);
  bool getExceptions(frame::ByteReader& reader, unsigned width, std::span<std::int64_t> residuals);
  void check(const Held& held);

  const Kernels& kernels_;
  std::array<Waiting, kTrackings> waiting_{};  // by predictor
  std::array<std::int64_t, kMostFastSamples> highs_;
  std::optional<std::size_t> bad_;
};

}  // namespace probebox::codec
