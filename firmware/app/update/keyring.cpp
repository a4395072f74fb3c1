#include "firmware/app/update/keyring.hpp"

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <span>

#include "protocol/frame/sha256.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

constexpr auto kKeyring = "/etc/rauc/keyring.pem";  // as board/image/system.conf.in has it

// RFC 4648; line ends and padding are passed over.
std::vector<std::byte> decodedBase64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::byte> bytes;
  std::uint32_t bits = 0;
  unsigned count = 0;
  for (const char c : text) {
    const auto digit = kDigits.find(c);
    if (digit == std::string_view::npos) continue;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count & 0xFF));
  }
  return bytes;
}

}  // namespace

std::vector<std::string> certificateFingerprints(std::string_view pem) {
  constexpr std::string_view kBegin = "-----BEGIN CERTIFICATE-----", kEnd = "-----END CERTIFICATE-----";
  std::vector<std::string> all;
  for (auto at = pem.find(kBegin); at != std::string_view::npos; at = pem.find(kBegin, at)) {
    at += kBegin.size();
    const auto end = pem.find(kEnd, at);
    if (end == std::string_view::npos) break;
    frame::Sha256 sum;
    sum.add(decodedBase64(pem.substr(at, end - at)));
    const auto digest = sum.digest();
    all.push_back(hexadecimal(std::as_bytes(std::span{digest})));
  }
  return all;
}

std::vector<std::string> imageKeys() {
  std::ifstream file{kKeyring};
  return certificateFingerprints(std::string{std::istreambuf_iterator<char>{file}, {}});
}

}  // namespace probebox::app
