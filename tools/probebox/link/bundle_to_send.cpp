#include "tools/probebox/link/bundle_to_send.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string_view>

#include "protocol/frame/sha256.hpp"
#include "protocol/units/plain_input.hpp"

namespace probebox::command {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kSizeBytes = 8;                 // of the signature's size, most significant first
constexpr std::uint64_t kMostSignature = 64U * 1024;  // RAUC's own limit
constexpr std::string_view kRemedy = ": give the .raucb that tools/image wrote beside the image";

Trouble notABundle(const std::string& path, const std::string& why) {
  return {ExitStatus::usage, "not-a-bundle", path + " is no update bundle: " + why + std::string{kRemedy}};
}

std::string textOf(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Recognises other files that people take for a bundle.
std::string whatElse(std::string_view head) {
  constexpr std::size_t kPartitionTable = 512;
  if (head.starts_with("\x28\xb5\x2f\xfd"sv)) return "it is packed by zstd, such as the image of a new box";
  if (head.substr(std::min(head.size(), kPartitionTable)).starts_with("EFI PART"))
    return "it is the image of a whole disk, which makes a new box";
  if (head.starts_with("!<arch>")) return "it is a Debian package";
  return "it does not begin as one";
}

std::optional<std::string> signatureOf(BundleToSend& bundle, std::uint64_t bytes) {
  if (bytes < kSizeBytes) return std::nullopt;
  std::uint64_t size = 0;
  for (const auto byte : bundle.part(bytes - kSizeBytes, kSizeBytes))
    size = size << 8U | std::to_integer<unsigned>(byte);
  if (size == 0 || size > kMostSignature || size + kSizeBytes >= bytes) return std::nullopt;
  auto signature = textOf(bundle.part(bytes - kSizeBytes - size, size));
  // A sequence of ASN.1.
  return signature.starts_with('\x30') ? std::optional{std::move(signature)} : std::nullopt;
}

// The manifest is signed as plain text.
std::string versionIn(std::string_view signature) {
  constexpr std::string_view kKey = "\nversion=";
  const auto at = signature.find(kKey);
  if (at == std::string_view::npos) return {};
  signature.remove_prefix(at + kKey.size());
  return std::string{signature.substr(0, signature.find('\n'))};
}

}  // namespace

Outcome<BundleToSend, Trouble> BundleToSend::open(const std::string& path) {
  constexpr std::size_t kHead = 1024, kSlice = 1U << 20U;
  if (const auto why = whyNoPlainInput(path))
    return Trouble{ExitStatus::usage, "unreadable", path + " cannot be read: " + *why};
  BundleToSend bundle;
  bundle.file_.open(path, std::ios::binary);
  std::error_code unknown;
  bundle.bytes_ = std::filesystem::file_size(path, unknown);
  if (!bundle.file_ || unknown)
    return Trouble{ExitStatus::usage, "unreadable", path + " cannot be read: check the name and its permissions"};
  bundle.name_ = std::filesystem::path{path}.filename().string();
  const auto head = textOf(bundle.part(0, kHead));
  if (!head.starts_with("hsqs")) return notABundle(path, whatElse(head));
  const auto signature = signatureOf(bundle, bundle.bytes_);
  if (!signature) return notABundle(path, "it has no signature at its end: it is cut off, or was never signed");
  bundle.version_ = versionIn(*signature);
  frame::Sha256 hash;
  std::uint64_t read = 0;
  for (auto slice = bundle.part(0, kSlice); !slice.empty(); slice = bundle.part(read, kSlice)) {
    hash.add(slice);
    read += slice.size();
  }
  if (read != bundle.bytes_)
    return Trouble{ExitStatus::usage, "unreadable", path + " cannot be read to its end: check the disk"};
  bundle.sha256_ = hash.digest();
  return bundle;
}

std::vector<std::byte> BundleToSend::part(std::uint64_t offset, std::size_t count) {
  std::vector<std::byte> bytes(count);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(offset));
  file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(file_.gcount()));
  return bytes;
}

}  // namespace probebox::command
