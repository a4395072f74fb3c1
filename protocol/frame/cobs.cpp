#include "protocol/frame/cobs.hpp"

#include <algorithm>
#include <cstring>

#include "protocol/frame/bytes.hpp"

namespace probebox::frame {
namespace {
constexpr std::size_t kLongestRun = 254;
}

std::size_t zeroIn(std::span<const std::byte> bytes) {
  if (bytes.empty()) return 0;
  const auto* zero = static_cast<const std::byte*>(std::memchr(bytes.data(), 0, bytes.size()));
  return zero == nullptr ? bytes.size() : static_cast<std::size_t>(zero - bytes.data());
}

std::size_t cobsEncode(std::span<const std::byte> plain, std::span<std::byte> into) {
  std::size_t out = 0;
  while (true) {
    const auto window = plain.first(std::min(plain.size(), kLongestRun));
    const std::size_t run = zeroIn(window);
    into[out] = static_cast<std::byte>(run + 1);
    copyBytes(window.first(run), into.data() + out + 1);
    out += run + 1;
    const bool ends_with_zero = run < window.size();
    plain = plain.subspan(run + (ends_with_zero ? 1 : 0));
    // A full run stands for no zero; when it ends the data, nothing follows.
    if (plain.empty() && !ends_with_zero) return out;
  }
}

std::optional<std::size_t> cobsDecodeInPlace(std::span<std::byte> bytes) {
  if (zeroIn(bytes) != bytes.size()) return std::nullopt;
  std::size_t in = 0;
  std::size_t out = 0;
  while (in < bytes.size()) {
    const auto code = std::to_integer<std::size_t>(bytes[in]);
    const std::size_t run = code - 1;
    if (in + 1 + run > bytes.size()) return std::nullopt;
    std::memmove(bytes.data() + out, bytes.data() + in + 1, run);
    in += run + 1;
    out += run;
    // The write position is always behind the read position, so a zero overwrites only what was read.
    if (run < kLongestRun && in < bytes.size()) bytes[out++] = std::byte{0};
  }
  return out;
}

}  // namespace probebox::frame
