#pragma once
#include <cstddef>
#include <optional>
#include <span>

// Codes bytes by consistent overhead byte stuffing (Cheshire and Baker, IEEE/ACM Trans. Networking 7(2), 1999).
// Coded bytes hold no zero, so a zero ends a frame even after an error.
namespace probebox::frame {

constexpr std::size_t cobsMaxSize(std::size_t plain) {
  return plain + plain / 254 + 1;
}

// Place of the first zero; the size where there is none.
std::size_t zeroIn(std::span<const std::byte> bytes);

// Codes `plain` into `into`, which must hold cobsMaxSize(plain.size()) bytes and not overlap it; returns the coded
// size.
std::size_t cobsEncode(std::span<const std::byte> plain, std::span<std::byte> into);

// Decodes in place and returns the front of `bytes`. Returns nothing when a length byte points beyond the end or a zero
// occurs inside.
std::optional<std::size_t> cobsDecodeInPlace(std::span<std::byte> bytes);

}  // namespace probebox::frame
