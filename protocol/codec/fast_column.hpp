#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/frame/bytes.hpp"

// One column of profile fast: what a predictor did not foresee, in as few bits as nearly all of it needs; the few that
// need more are exceptions behind.
//
//   per channel {u8 order, + 0x80 with exceptions; u8 width}
//   column: seeds | residuals, `width` bits each, two's complement, value after value from the lowest bit of the first
//   byte on, the last byte filled up with zeros | exceptions
//   order: 0 to 3, that difference, with as many seeds; 4, tracking (kernels.cpp), with 3 seeds
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

// Codes one column after the other, with memory of its own.
class FastColumnEncoder {
 public:
  explicit FastColumnEncoder(const Kernels& kernels) : kernels_{kernels} {}

  // The shortest coding of those that are tried; never longer than raw. Every value fits its channel; at most
  // kMostFastSamples.
  const FastPlan& plan(ChannelFormat format, std::span<const std::int64_t> column);

  // Writes the planned column, plan().bytes bytes; the writer has room for them.
  void put(frame::ByteWriter& writer, ChannelFormat format, std::span<const std::int64_t> column);

 private:
  using Residuals = std::array<std::uint64_t, kMostFastSamples>;

  std::uint8_t choosePredictor(std::span<const std::int64_t> column);
  void chooseWidth(std::size_t count);
  bool considerFrom(std::size_t count, unsigned width);
  void consider(std::size_t count, unsigned width, std::size_t exceptions);
  void pack(std::span<std::byte> into, std::size_t count) const;

  const Kernels& kernels_;
  FastPlan plan_{};
  std::uint8_t order_{};       // as tried
  std::size_t seeds_bytes_{};  // of that order
  Size size_{};                // of the residuals
  Residuals different_;        // of a difference
  Residuals tracked_;
  std::uint64_t* residuals_{};  // of the two: the chosen ones, then zeros up to a whole group
  std::array<std::uint16_t, kMostFastSamples> places_;
};

// coding: the two bytes of the channel list. False with the reader failed when bytes are missing, false without when
// the column makes no sense or a value is outside its channel.
bool getFast(frame::ByteReader& reader, ChannelFormat format, std::uint8_t order, std::uint8_t width,
             std::span<std::int64_t> column, const Kernels& kernels);

}  // namespace probebox::codec
