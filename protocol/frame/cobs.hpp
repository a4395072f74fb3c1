#pragma once
#include <cstddef>
#include <optional>
#include <span>

// Consistent overhead byte stuffing (Cheshire and Baker, IEEE/ACM Transactions on Networking 7(2), 1999): the coded
// bytes hold no zero, so that a zero ends a frame whatever went wrong before it.
namespace probebox::frame {

constexpr std::size_t cobsMaxSize(std::size_t plain) {
  return plain + plain / 254 + 1;
}

// Codes `plain` into `into`, which must hold cobsMaxSize(plain.size()) bytes and not overlap it; returns the coded
// size.
std::size_t cobsEncode(std::span<const std::byte> plain, std::span<std::byte> into);

// Decodes in place: the plain bytes are the front of `bytes`. Nothing when a length byte points beyond the end or a
// zero stands inside.
std::optional<std::size_t> cobsDecodeInPlace(std::span<std::byte> bytes);

}  // namespace probebox::frame
