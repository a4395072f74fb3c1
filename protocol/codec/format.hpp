#pragma once
#include <cstddef>
#include <cstdint>

namespace probebox::codec {

// How a block is coded: its first byte. A stream of profile tight has blocks of both its kinds.
enum class Profile : std::uint8_t { raw = 0, fast = 1, tight = 2, tight_continued = 3 };

// Describes a channel's values in profile raw. An unsigned channel of 8 bytes holds 0 to 2^63 - 1.
struct ChannelFormat {
  std::uint8_t bytes{4};  // 1, 2, 4 or 8
  bool is_signed{true};

  friend constexpr bool operator==(const ChannelFormat&, const ChannelFormat&) = default;
};

inline constexpr std::size_t kMaxChannels = 255;
inline constexpr std::size_t kMostFastSamples = 2048;  // limit of this encoder for profile fast

}  // namespace probebox::codec
