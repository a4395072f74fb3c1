#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/codec/format.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/frame/bytes.hpp"

// One column of profile fast: what a predictor did not foresee, in as few bits as nearly all of it needs; the few that
// need more are exceptions behind.
//
//   per channel {u8 order, + 0x80 with exceptions; u8 width}
//   column: seeds | residuals, `width` bits each, two's complement, value after value from the lowest bit of the first
//   byte on, the last byte filled up with zeros | exceptions
//   order: 0 to 3, that difference, with as many seeds; 4, tracking (prediction.hpp), with 3 seeds
//   seed j: the j-th difference at sample j, as zigzag varint (0, -1, 1, -2 ... as 0, 1, 2, 3 ...; 7 bits a byte,
//   lowest first, 0x80 where more follow) exceptions: their number and u8 bytes of a high part, then their positions,
//   then their high parts (two's complement): the residual is high part x 2^width + its `width` bits. Number and
//   positions (of residuals, from 0) are u8 where the column has at most 256 residuals, u16 elsewhere.
//
// Order 0 with width 8 x bytes of the channel and no exceptions is a column of profile raw.
namespace probebox::codec {

constexpr std::size_t seedsOf(std::size_t order) {
  return order == kTracking ? kMostOrder : order;
}

// How a column is coded.
struct FastPlan {
  std::uint8_t order{};
  std::uint8_t width{};
  std::uint32_t exceptions{};
  std::uint8_t high_bytes{};  // of an exception
  std::size_t bytes{};        // of the column, seeds and exceptions included

  std::uint8_t orderByte() const { return static_cast<std::uint8_t>(order | (exceptions > 0 ? 0x80U : 0U)); }
  bool isRaw(ChannelFormat format) const { return order == 0 && exceptions == 0 && width == 8 * format.bytes; }
};

// Codes the columns of a block, some at once, with memory of its own.
class FastColumnEncoder {
 public:
  explicit FastColumnEncoder(const Kernels& kernels) : kernels_{kernels} {}

  struct Column {
    ChannelFormat format{};
    std::span<const std::int64_t> values;
  };

  // The shortest coding of those that are tried; never longer than raw. At most kTracked columns of the same length,
  // at most kMostFastSamples. Every value fits its channel.
  void plan(std::span<const Column> columns);
  const FastPlan& planOf(std::size_t column) const { return works_[column].plan; }

  // Writes a planned column, planOf().bytes bytes; the writer has room for them.
  void put(frame::ByteWriter& writer, std::size_t column);

 private:
  // What there is of one column while it is coded.
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
  void track(std::size_t count);
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
};

// Decodes the columns of a block, which are of one length.
class FastColumnDecoder {
 public:
  explicit FastColumnDecoder(const Kernels& kernels) : kernels_{kernels} {}

  // order, width: the two bytes of the channel list. Columns may be held back until some can be done at once. The
  // reader has failed when bytes are missing.
  void get(frame::ByteReader& reader, std::size_t channel, ChannelFormat format, std::uint8_t order, std::uint8_t width,
           std::span<std::int64_t> column);
  // Does what was held back.
  void finish();

  // The channel whose column makes no sense or holds a value outside its range.
  std::optional<std::size_t> bad() const { return bad_; }

 private:
  struct Held {
    std::size_t channel{};
    ChannelFormat format{};
    std::span<std::int64_t> column;
  };

  bool read(frame::ByteReader& reader, const Held& held, std::uint8_t order, std::uint8_t width);
  void check(const Held& held);

  const Kernels& kernels_;
  std::array<Held, kUntracked> held_{};
  std::size_t how_many_{};
  std::optional<std::size_t> bad_;
};

}  // namespace probebox::codec
