#include "protocol/frame/cobs.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "protocol/frame/bytes.hpp"

namespace probebox::frame {
namespace {
constexpr std::size_t kLongestRun = 254;

// Calls `visit` with the place of each zero, in order. Eight bytes at a time: records hold a zero every few bytes, for
// which a call of memchr each costs more than the bytes.
template <class Visit>
void forEachZero(std::span<const std::byte> bytes, Visit visit) {
  constexpr std::uint64_t kLow7 = 0x7F7F'7F7F'7F7F'7F7F;
  std::size_t at = 0;
  for (; at + 8 <= bytes.size(); at += 8) {
    const auto word = loadLittle<std::uint64_t>(bytes.data() + at);
    // Bit 7 of each byte that is zero, and no other.
    for (auto zeros = ~(((word & kLow7) + kLow7) | word | kLow7); zeros != 0; zeros &= zeros - 1)
      visit(at + static_cast<std::size_t>(std::countr_zero(zeros)) / 8);
  }
  for (; at < bytes.size(); ++at) {
    if (bytes[at] == std::byte{0}) visit(at);
  }
}

}  // namespace

std::size_t zeroIn(std::span<const std::byte> bytes) {
  if (bytes.empty()) return 0;
  const auto* zero = static_cast<const std::byte*>(std::memchr(bytes.data(), 0, bytes.size()));
  return zero == nullptr ? bytes.size() : static_cast<std::size_t>(zero - bytes.data());
}

// A zero is replaced by the code of the run that it ends, so bytes keep their places; only a run of kLongestRun shifts
// what follows by one. So a whole window is copied at once, and codes are put where its zeros were.
std::size_t cobsEncode(std::span<const std::byte> plain, std::span<std::byte> into) {
  std::size_t code_at = 0;
  while (true) {
    const auto window = plain.first(std::min(plain.size(), kLongestRun));
    copyBytes(window, into.data() + code_at + 1);
    std::size_t begin = 0;  // of the run, in the window
    forEachZero(window, [&](std::size_t zero) {
      const std::size_t run = zero - begin;
      into[code_at] = static_cast<std::byte>(run + 1);
      code_at += run + 1;
      begin = zero + 1;
    });
    const bool ends_with_plain = window.size() == plain.size();
    if (begin > 0 && !ends_with_plain) {
      plain = plain.subspan(begin);  // the last run may go on behind the window
      continue;
    }
    into[code_at] = static_cast<std::byte>(window.size() - begin + 1);
    code_at += window.size() - begin + 1;
    // A full run stands for no zero; when it ends the data, nothing follows.
    if (ends_with_plain) return code_at;
    plain = plain.subspan(window.size());
  }
}

std::optional<std::size_t> cobsDecodeInPlace(std::span<std::byte> bytes) {
  if (zeroIn(bytes) != bytes.size()) return std::nullopt;
  std::size_t in = 0;
  std::size_t out = 0;
  while (in < bytes.size()) {
    // From here to the next full run bytes keep their places: codes become zeros, then all move together.
    const std::size_t begin = in + 1;
    auto code = std::to_integer<std::size_t>(bytes[in]);
    for (in += code; in < bytes.size() && code <= kLongestRun; in += code) {
      code = std::to_integer<std::size_t>(bytes[in]);
      bytes[in] = std::byte{0};
    }
    if (in > bytes.size()) return std::nullopt;
    std::memmove(bytes.data() + out, bytes.data() + begin, in - begin);
    out += in - begin;
  }
  return out;
}

}  // namespace probebox::frame
