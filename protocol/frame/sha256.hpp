#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <sha2.h>
#include <span>

namespace probebox::frame {

// Computes SHA-256 (FIPS 180-4) of bytes that come piece by piece, by libmd.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, SHA256_DIGEST_LENGTH>;

  Sha256() { SHA256Init(&state_); }

  void add(std::span<const std::byte> bytes) {
    SHA256Update(&state_, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  // Digest of all bytes added so far; more may be added afterwards.
  Digest digest() const {
    SHA2_CTX whole = state_;
    Digest digest{};
    SHA256Final(digest.data(), &whole);
    return digest;
  }

 private:
  SHA2_CTX state_{};
};

}  // namespace probebox::frame
