#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/frame/cobs.hpp"
#include "protocol/units/outcome.hpp"

// One frame: header, payload, CRC-32C. docs/decisions/0001-frame-layout.md says why.
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
// The largest payload this project sends; a receiver may be built for less.
inline constexpr std::size_t kMaxPayload = 16384;

constexpr std::size_t bareSize(std::size_t payload) {
  return payload + kOverhead;
}
constexpr std::size_t delimitedMaxSize(std::size_t payload) {
  return cobsMaxSize(bareSize(payload)) + 1;
}

// A frame that has been checked. The payload belongs to whoever gave it.
struct Frame {
  Header header{};
  std::span<const std::byte> payload{};
};

// How frames follow each other: with a delimiter after each, or one right after the other.
enum class Framing : std::uint8_t { delimited, bare };

enum class FrameFault : std::uint8_t { bad_cobs, bad_length, bad_crc, oversize };

// Both return the size of the frame, or 0 when `into` is too small or the payload too long for a frame.
// The payload may not overlap `into`. header.payload_length is set here, whatever it was.
// Bare: for carriers that neither lose nor damage bytes (USB bulk transfers).
std::size_t encodeBare(Header header, std::span<const std::byte> payload, std::span<std::byte> into);
// Delimited: COBS and a zero, for serial lines, TCP, pseudo terminals and files. `scratch` holds bareSize(payload)
// bytes.
std::size_t encodeDelimited(Header header, std::span<const std::byte> payload, std::span<std::byte> scratch,
                            std::span<std::byte> into);

// Either of them.
inline std::size_t encode(Framing framing, Header header, std::span<const std::byte> payload,
                          std::span<std::byte> scratch, std::span<std::byte> into) {
  return framing == Framing::bare ? encodeBare(header, payload, into) : encodeDelimited(header, payload, scratch, into);
}

// Reads the header only; nothing of it has been checked. `bytes` holds kHeaderSize bytes at least.
Header headerOf(std::span<const std::byte> bytes);

// Checks length and CRC. The payload of the answer lies in `bytes`.
Outcome<Frame, FrameFault> decodeBare(std::span<const std::byte> bytes);

}  // namespace probebox::frame
