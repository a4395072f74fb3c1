#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace probebox::frame {

// Computes SHA-256 (FIPS 180-4) of bytes that come piece by piece.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, 32>;

  void add(std::span<const std::byte> bytes);
  // Of all that was added; more may be added afterwards.
  Digest digest() const;

 private:
  static constexpr std::size_t kBlock = 64;

  void pad();
  void compress(const std::byte* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::byte, kBlock> rest_{};  // the block that is not full yet
  std::uint64_t bytes_{};
};

}  // namespace probebox::frame
