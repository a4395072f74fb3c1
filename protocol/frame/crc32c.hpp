#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

namespace probebox::frame {

// Computes CRC-32C (Castagnoli; RFC 3720 appendix B.4): reflected polynomial 0x82F63B78, initial value, final xor ones.
// `so_far` is the CRC of the bytes before, so that crc32c(b, crc32c(a)) is the CRC of a followed by b.
// Uses the processor's instruction (SSE4.2, armv8 crc) where it has one.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far = 0);

// Select the implementation. A processor without the instruction uses the table.
std::uint32_t crc32cByTable(std::span<const std::byte> bytes, std::uint32_t so_far = 0);
std::uint32_t crc32cByInstruction(std::span<const std::byte> bytes, std::uint32_t so_far = 0);
bool hasCrc32cInstruction();

}  // namespace probebox::frame
