#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

// Codes symbols of known probability into bytes, at a cost of a thousandth of a bit over their information: a range
// coder without carries, of 64 bits.
namespace probebox::codec {

// The part of the range that is left. Encoder and decoder narrow it alike.
class Interval {
 public:
  static constexpr unsigned kProbabilityBits = 24;

  // Narrows to [from, from + size) of 2^bits parts; bits: at most kProbabilityBits.
  void narrow(std::uint64_t from, std::uint64_t size, unsigned bits) {
    range_ >>= bits;
    low_ += from * range_;
    range_ *= size;
  }
  // Calls shift(byte) for every leading byte that is decided. A range that has become too small at a border that the
  // byte may still cross ends there.
  void renormalize(auto&& shift) {
    while (true) {
      if ((low_ ^ (low_ + range_)) >= kDecided) {
        if (range_ >= kSmallest) return;
        range_ = (0 - low_) & (kSmallest - 1);
      }
      shift(static_cast<std::byte>(low_ >> 56U));
      low_ <<= 8U;
      range_ <<= 8U;
    }
  }
  // Where `code` lies, in parts of 2^bits; more than that is none that an encoder writes.
  std::uint64_t partOf(std::uint64_t code, unsigned bits) const { return (code - low_) / (range_ >> bits); }

  // The value inside with the most zeros at its end: its other bytes are all that need be written.
  struct End {
    std::uint64_t code{};
    std::size_t bytes{};
  };
  End end() const {
    for (std::size_t bytes = 0; bytes < 8; ++bytes) {
      const std::uint64_t rest = ~std::uint64_t{0} >> (8 * bytes);
      const auto code = (low_ + rest) & ~rest;
      if (code - low_ < range_ && code >= low_) return {code, bytes};
    }
    return {low_, 8};
  }

 private:
  static constexpr std::uint64_t kDecided = std::uint64_t{1} << 56U;
  static constexpr std::uint64_t kSmallest = std::uint64_t{1} << 40U;

  std::uint64_t low_{};
  std::uint64_t range_{~std::uint64_t{0}};
};

class RangeEncoder {
 public:
  explicit RangeEncoder(std::span<std::byte> into) : into_{into} {}

  void put(std::uint64_t from, std::uint64_t size, unsigned bits = Interval::kProbabilityBits) {
    interval_.narrow(from, size, bits);
    interval_.renormalize([this](std::byte byte) { write(byte); });
  }
  // The lowest `count` bits of a value, all equally probable.
  void putBits(std::uint64_t value, unsigned count) {
    for (; count > 16; count -= 16, value >>= 16U) put(value & 0xFFFFU, 1, 16);
    if (count > 0) put(value & ((std::uint64_t{1} << count) - 1), 1, count);
  }
  // Returns the number of bytes, more than there is room for where it did not suffice.
  std::size_t finish() {
    const auto [code, bytes] = interval_.end();
    for (std::size_t k = 0; k < bytes; ++k) write(static_cast<std::byte>(code >> (56 - 8 * k)));
    return size_;
  }

 private:
  void write(std::byte byte) {
    if (size_ < into_.size()) into_[size_] = byte;
    ++size_;
  }

  Interval interval_;
  std::span<std::byte> into_;
  std::size_t size_{};
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> from) : from_{from} {
    for (int k = 0; k < 8; ++k) read();
  }

  // In which of 2^bits parts the next symbol lies; take() then says which part it covers.
  std::uint64_t next(unsigned bits = Interval::kProbabilityBits) const {
    return std::min(interval_.partOf(code_, bits), (std::uint64_t{1} << bits) - 1);
  }
  void take(std::uint64_t from, std::uint64_t size, unsigned bits = Interval::kProbabilityBits) {
    interval_.narrow(from, size, bits);
    interval_.renormalize([this](std::byte) { read(); });
  }
  std::uint64_t getBits(unsigned count) {
    std::uint64_t value = 0;
    for (unsigned done = 0; done < count;) {
      const unsigned bits = std::min(count - done, 16U);
      const auto part = next(bits);
      take(part, 1, bits);
      value |= part << done;
      done += bits;
    }
    return value;
  }
  // Whether the bytes end as an encoder would have ended them.
  bool ended() const {
    const auto [code, bytes] = interval_.end();
    return code == code_ && read_ == from_.size() + 8 - bytes;
  }

 private:
  void read() {
    code_ = (code_ << 8U) | (read_ < from_.size() ? std::to_integer<std::uint64_t>(from_[read_]) : 0);
    ++read_;
  }

  Interval interval_;
  std::span<const std::byte> from_;
  std::uint64_t code_{};
  std::size_t read_{};
};

}  // namespace probebox::codec
