#pragma once
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "protocol/frame/bytes.hpp"

// Codes how a structure of numbers differs from an earlier one: u8 n, then n bytes with a bit for each number in the
// order of its field list, those of structures inside in their place, the lowest bit of the first byte first, 1 where
// it has changed. Then each changed number as new minus old, zigzag coded as varint (bytes.hpp). A later minor version
// may add numbers at the end, which a reader skips, but none to a structure inside.
namespace probebox::frame {

// A structure that lists its fields, as messages do (protocol/messages/fields.hpp).
template <class T>
concept Listed = requires(T& value) {
  T::fields(value, [](auto&&...) {});
};

namespace detail {

// Calls take(number) for each number of a structure; what it returns becomes the number.
template <class T>
constexpr void forEachNumber(T& value, auto&& take) {
  if constexpr (Listed<T>) {
    T::fields(value, [&](auto, auto& member, auto&&...) { forEachNumber(member, take); });
  } else if constexpr (requires { value.index; }) {
    forEachNumber(value.index, take);
  } else if constexpr (std::same_as<T, MonoTime>) {
    value = monoTime(static_cast<std::int64_t>(take(static_cast<std::uint64_t>(toNs(value)))));
  } else if constexpr (std::same_as<T, bool>) {
    value = take(value ? 1U : 0U) != 0;
  } else {
    static_assert(std::integral<T> || std::is_enum_v<T>, "only numbers have differences");
    value = static_cast<T>(take(static_cast<std::uint64_t>(value)));
  }
}

}  // namespace detail

template <Listed T>
constexpr std::size_t numbersOf() {
  std::size_t count = 0;
  T value{};
  detail::forEachNumber(value, [&](std::uint64_t number) {
    ++count;
    return number;
  });
  return count;
}

// Writes how `now` differs from `base`.
template <Listed T>
void putChanges(ByteWriter& writer, T base, T now) {
  std::array<std::uint64_t, numbersOf<T>()> differences{};
  std::size_t k = 0;
  detail::forEachNumber(base, [&](std::uint64_t number) { return differences[k++] = number; });
  k = 0;
  detail::forEachNumber(now, [&](std::uint64_t number) {
    differences[k] = number - differences[k];
    return ++k, number;
  });
  writer.put(static_cast<std::uint8_t>((differences.size() + 7) / 8));
  for (std::size_t first = 0; first < differences.size(); first += 8) {
    unsigned bits = 0;
    for (std::size_t bit = 0; bit < 8 && first + bit < differences.size(); ++bit)
      bits |= (differences[first + bit] != 0 ? 1U : 0U) << bit;
    writer.put(static_cast<std::uint8_t>(bits));
  }
  for (const std::uint64_t difference : differences) {
    if (difference != 0) putVarint(writer, zigzag(difference));
  }
}

// Returns `base` with the changes that the reader has next. Where they are cut off the reader fails.
template <Listed T>
T withChanges(T base, ByteReader& reader) {
  const auto changed = reader.take(reader.get<std::uint8_t>());
  std::size_t k = 0;
  const auto next = [&](std::uint64_t number) {
    const bool is_changed = k < 8 * changed.size() && std::to_integer<unsigned>(changed[k / 8] >> (k % 8)) % 2 == 1;
    ++k;
    return is_changed ? number + unzigzag(getVarint(reader)) : number;
  };
  detail::forEachNumber(base, next);
  while (k < 8 * changed.size()) next(0);
  return base;
}

}  // namespace probebox::frame
