#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::iio {

// Format of one channel in a frame of the kernel's buffer: scan_elements/in_CHANNEL_type, such as "le:s12/16>>4".
struct ScanFormat {
  bool big_endian{};
  bool is_signed{};
  unsigned real_bits{};     // 1 to 64
  unsigned storage_bits{};  // 8, 16, 32 or 64
  unsigned shift{};         // the value begins at this bit

  std::size_t bytes() const { return storage_bits / 8; }
  // Smallest and largest value, at which a converter clips.
  std::int64_t least() const;
  std::int64_t greatest() const;
  friend bool operator==(const ScanFormat&, const ScanFormat&) = default;
};

// Errors: another form than above, an impossible width, several values in one channel ("X3").
Outcome<ScanFormat> parseScanFormat(std::string_view text);

// The kernel's stamp, the last channel of a frame: int64, ns, in native byte order.
inline constexpr ScanFormat kStampFormat{.big_endian = std::endian::native == std::endian::big,
                                         .is_signed = true,
                                         .real_bits = 64,
                                         .storage_bits = 64,
                                         .shift = 0};

// bytes: format.bytes() bytes.
std::int64_t readValue(const ScanFormat& format, std::span<const std::byte> bytes);
// The opposite, for the emulator. A value out of range is clipped, as a converter does.
void writeValue(const ScanFormat& format, std::int64_t value, std::span<std::byte> bytes);

// Offsets of the enabled channels in a frame, in the order of their scan index: each channel is aligned to its own
// size, and the frame to the largest.
struct FrameLayout {
  std::vector<std::size_t> offsets;
  std::size_t bytes{};
};
FrameLayout layOut(std::span<const ScanFormat> formats);

}  // namespace probebox::iio
