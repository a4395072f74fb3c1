#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/frame/cobs.hpp"
#include "protocol/units/outcome.hpp"

// Builds and checks frames: header, payload, CRC-32C. docs/decisions/0001-frame-layout.md gives the reasons.
namespace probebox::frame {

struct Header {
  std::uint8_t major{1};
  std::uint8_t type{};
  std::uint8_t flags{};
  std::uint8_t stream{};
  std::uint16_t payload_length{};
  std::uint32_t sequence{};
  std::uint32_t descriptor_hash{};
  static constexpr void fields(auto& self, auto&& field) {
    field("major", self.major, "protocol major; both sides must have the same");
    field("type", self.type, "which message the payload is; unknown types are skipped");
    field("flags", self.flags, "0, reserved");
    field("stream", self.stream, "stream id; a changed sample format is a new stream, 0 for control");
    field("payload_length", self.payload_length, "bytes of payload");
    field("sequence", self.sequence, "+1 every frame of this direction of this lane; a gap means frames were lost");
    field("descriptor_hash", self.descriptor_hash, "CRC-32C of the DESCRIPTOR's payload; 0 before there was one");
  }
  friend constexpr bool operator==(const Header&, const Header&) = default;
};

inline constexpr std::byte kDelimiter{0};
inline constexpr std::size_t kHeaderSize = 14;
inline constexpr std::size_t kCrcSize = 4;
inline constexpr std::size_t kOverhead = kHeaderSize + kCrcSize;
// Limits the payloads that this project sends; a receiver may be built for less.
inline constexpr std::size_t kMaxPayload = 16384;

constexpr std::size_t bareSize(std::size_t payload) {
  return payload + kOverhead;
}
constexpr std::size_t delimitedMaxSize(std::size_t payload) {
  return cobsMaxSize(bareSize(payload)) + 1;
}

// Holds a checked frame. The payload points into the bytes of the caller.
struct Frame {
  Header header{};
  std::span<const std::byte> payload{};
};

// Selects whether a delimiter follows each frame.
enum class Framing : std::uint8_t { delimited, bare };

enum class FrameFault : std::uint8_t { bad_cobs, bad_length, bad_crc, oversize };

// Build a frame; return its size, or 0 when `into` is too small or the payload too long for a frame.
// The payload may not overlap `into`. They set header.payload_length.
// Bare: for carriers that neither lose nor damage bytes (USB bulk transfers).
std::size_t encodeBare(Header header, std::span<const std::byte> payload, std::span<std::byte> into);
// Delimited: COBS and a zero, for serial lines, TCP, pseudo terminals and files. `scratch` holds bareSize(payload)
// bytes.
std::size_t encodeDelimited(Header header, std::span<const std::byte> payload, std::span<std::byte> scratch,
                            std::span<std::byte> into);

// Builds a frame of the given kind.
inline std::size_t encode(Framing framing, Header header, std::span<const std::byte> payload,
                          std::span<std::byte> scratch, std::span<std::byte> into) {
  return framing == Framing::bare ? encodeBare(header, payload, into) : encodeDelimited(header, payload, scratch, into);
}

// Reads the header without checking it. `bytes` must hold at least kHeaderSize bytes.
Header headerOf(std::span<const std::byte> bytes);

// Checks length and CRC. The payload of the returned frame points into `bytes`.
Outcome<Frame, FrameFault> decodeBare(std::span<const std::byte> bytes);

}  // namespace probebox::frame
