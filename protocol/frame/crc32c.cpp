#include "protocol/frame/crc32c.hpp"

#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <nmmintrin.h>
#elif defined(__aarch64__)
#include <arm_acle.h>
#include <asm/hwcap.h>
#include <sys/auxv.h>
#endif

namespace probebox::frame {
namespace {

constexpr std::uint32_t kPolynomial = 0x82F63B78;
using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

// Table k holds the effect of a byte that is followed by k zero bytes: eight bytes are then eight independent look-ups.
constexpr Tables makeTables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ kPolynomial : crc >> 1U;
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const auto before = tables[k - 1][byte];
      tables[k][byte] = (before >> 8U) ^ tables[0][before & 0xFFU];
    }
  }
  return tables;
}
constexpr Tables kTables = makeTables();

constexpr std::uint32_t step(std::uint32_t crc, std::byte byte) {
  return (crc >> 8U) ^ kTables[0][(crc ^ std::to_integer<std::uint32_t>(byte)) & 0xFFU];
}

}  // namespace

std::uint32_t crc32cByTable(std::span<const std::byte> bytes, std::uint32_t so_far) {
  std::uint32_t crc = ~so_far;
  while (bytes.size() >= 8) {
    std::uint32_t next = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto mixed = (crc >> (8 * k)) ^ std::to_integer<std::uint32_t>(bytes[k]);
      next ^= kTables[7 - k][mixed & 0xFFU] ^ kTables[3 - k][std::to_integer<std::size_t>(bytes[k + 4])];
    }
    crc = next;
    bytes = bytes.subspan(8);
  }
  for (const auto byte : bytes) crc = step(crc, byte);
  return ~crc;
}

#if defined(__x86_64__)

bool hasCrc32cInstruction() {
  return __builtin_cpu_supports("sse4.2") != 0;
}

__attribute__((target("sse4.2"))) std::uint32_t crc32cByInstruction(std::span<const std::byte> bytes,
                                                                    std::uint32_t so_far) {
  std::uint64_t crc = ~so_far;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    std::uint64_t word{};
    std::memcpy(&word, bytes.data(), sizeof word);
    crc = _mm_crc32_u64(crc, word);
  }
  auto rest = static_cast<std::uint32_t>(crc);
  for (const auto byte : bytes) rest = _mm_crc32_u8(rest, std::to_integer<std::uint8_t>(byte));
  return ~rest;
}

#elif defined(__aarch64__)

bool hasCrc32cInstruction() {
  return (getauxval(AT_HWCAP) & HWCAP_CRC32) != 0;
}

__attribute__((target("+crc"))) std::uint32_t crc32cByInstruction(std::span<const std::byte> bytes,
                                                                  std::uint32_t so_far) {
  std::uint32_t crc = ~so_far;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    std::uint64_t word{};
    std::memcpy(&word, bytes.data(), sizeof word);
    crc = __crc32cd(crc, word);
  }
  for (const auto byte : bytes) crc = __crc32cb(crc, std::to_integer<std::uint8_t>(byte));
  return ~crc;
}

#else

bool hasCrc32cInstruction() {
  return false;
}

std::uint32_t crc32cByInstruction(std::span<const std::byte> bytes, std::uint32_t so_far) {
  return crc32cByTable(bytes, so_far);
}

#endif

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far) {
  static const bool has_instruction = hasCrc32cInstruction();
  return has_instruction ? crc32cByInstruction(bytes, so_far) : crc32cByTable(bytes, so_far);
}

}  // namespace probebox::frame
