#pragma once
#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "protocol/units/time.hpp"

// Reads and writes numbers as little-endian bytes on every machine.
namespace probebox::frame {

// Admits the types of a field of fixed size.
template <class T>
concept Scalar = std::integral<T> || std::is_enum_v<T> || std::same_as<T, double> || std::same_as<T, MonoTime> ||
    std::same_as<T, Tick> || std::same_as<T, SampleIndex>;

// Load and store integers at any address, in loops that the compiler vectorises.
template <std::integral T>
void storeLittle(T value, std::byte* at) {
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(at, &value, sizeof value);
  } else {
    for (std::size_t k = 0; k < sizeof value; ++k)
      at[k] = static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8 * k));
  }
}
template <std::integral T>
T loadLittle(const std::byte* at) {
  if constexpr (std::endian::native == std::endian::little) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
  } else {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) value |= std::to_integer<std::uint64_t>(at[k]) << (8 * k);
    return static_cast<T>(value);
  }
}

// Of libstdc++ 12, std::ranges::copy moves const bytes one by one.
inline void copyBytes(std::span<const std::byte> from, std::byte* to) {
  if (!from.empty()) std::memcpy(to, from.data(), from.size());
}

// Writes into the caller's bytes. Bytes that do not fit are not written but counted: size() returns the room that was
// needed.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> into) : into_{into} {}

  template <Scalar T>
  void put(T value) {
    if constexpr (std::same_as<T, MonoTime>) {
      put(toNs(value));
    } else if constexpr (std::same_as<T, Tick> || std::same_as<T, SampleIndex>) {
      put(value.index);
    } else if constexpr (std::same_as<T, double>) {
      put(std::bit_cast<std::uint64_t>(value));
    } else if constexpr (std::is_enum_v<T>) {
      put(static_cast<std::underlying_type_t<T>>(value));
    } else if constexpr (std::same_as<T, bool>) {
      put(static_cast<std::uint8_t>(value ? 1 : 0));
    } else {
      putInteger(static_cast<std::make_unsigned_t<T>>(value));
    }
  }

  void put(std::span<const std::byte> bytes) {
    if (fits(bytes.size())) copyBytes(bytes, into_.data() + size_);
    size_ += bytes.size();
  }

  // Reserves the next `count` bytes for the caller to write; returns an empty span without room, and counts them.
  std::span<std::byte> take(std::size_t count) {
    const auto room = fits(count) ? into_.subspan(size_, count) : std::span<std::byte>{};
    size_ += count;
    return room;
  }

  // Writes a size into its place `at` once it is known.
  void patch(std::size_t at, std::uint16_t value) {
    if (at + 2 > into_.size()) return;
    into_[at] = static_cast<std::byte>(value & 0xFFU);
    into_[at + 1] = static_cast<std::byte>(value >> 8U);
  }

  // Notes a value that the format cannot hold, such as a text of more than 65535 bytes.
  void refuse() { refused_ = true; }

  std::size_t size() const { return size_; }
  // Returns the bytes that are left to write.
  std::size_t room() const { return into_.size() - std::min(size_, into_.size()); }
  bool complete() const { return !refused_ && size_ <= into_.size(); }
  bool refused() const { return refused_; }

 private:
  bool fits(std::size_t count) const { return size_ + count <= into_.size(); }

  template <std::unsigned_integral U>
  void putInteger(U value) {
    const auto room = take(sizeof(U));
    if (!room.empty()) storeLittle(value, room.data());
  }

  std::span<std::byte> into_;
  std::size_t size_{};
  bool refused_{};
};

// Reads from the caller's bytes. After the first read beyond the end it reports failure and returns zeros.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> from) : from_{from} {}

  template <Scalar T>
  T get() {
    if constexpr (std::same_as<T, MonoTime>) {
      return monoTime(get<std::int64_t>());
    } else if constexpr (std::same_as<T, Tick> || std::same_as<T, SampleIndex>) {
      return T{get<std::int64_t>()};
    } else if constexpr (std::same_as<T, double>) {
      return std::bit_cast<double>(get<std::uint64_t>());
    } else if constexpr (std::is_enum_v<T>) {
      return static_cast<T>(get<std::underlying_type_t<T>>());
    } else if constexpr (std::same_as<T, bool>) {
      return get<std::uint8_t>() != 0;
    } else {
      return static_cast<T>(getInteger<std::make_unsigned_t<T>>());
    }
  }

  // Returns the next `count` bytes; fails and returns an empty span where fewer are left.
  std::span<const std::byte> take(std::size_t count) {
    if (count > remaining()) {
      failed_ = true;
      from_ = {};
      return {};
    }
    const auto taken = from_.first(count);
    from_ = from_.subspan(count);
    return taken;
  }

  void fail() { failed_ = true; }
  std::size_t remaining() const { return from_.size(); }
  bool failed() const { return failed_; }

 private:
  template <std::unsigned_integral U>
  U getInteger() {
    const auto bytes = take(sizeof(U));
    return bytes.empty() ? U{} : loadLittle<U>(bytes.data());
  }

  std::span<const std::byte> from_;
  bool failed_{};
};

// 0, -1, 1, -2 as 0, 1, 2, 3, modulo 2^64, and back.
constexpr std::uint64_t zigzag(std::uint64_t value) {
  return (value << 1U) ^ (0 - (value >> 63U));
}
constexpr std::uint64_t unzigzag(std::uint64_t coded) {
  return (coded >> 1U) ^ (0 - (coded & 1U));
}

// 7 bits a byte, lowest first, 0x80 set where more bytes follow.
inline void putVarint(ByteWriter& writer, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7U) writer.put(static_cast<std::uint8_t>(value | 0x80U));
  writer.put(static_cast<std::uint8_t>(value));
}
// Fails where more than ten bytes follow each other.
inline std::uint64_t getVarint(ByteReader& reader) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const auto byte = reader.get<std::uint8_t>();
    value |= std::uint64_t{byte & 0x7FU} << shift;
    if (byte < 0x80) return value;
  }
  reader.fail();
  return value;
}

}  // namespace probebox::frame
