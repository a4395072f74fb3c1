#pragma once
#include <fstream>
#include <random>
#include <string>

namespace probebox::support {

// Writes a file that looks like a RAUC bundle from outside: a squashfs, a signature with a manifest, the signature's
// size. Returns its bytes.
inline std::string writeBundle(const std::string& path, std::size_t squashfs_bytes, const std::string& version) {
  std::mt19937 random{7};
  std::string bytes = "hsqs";
  while (bytes.size() < squashfs_bytes) bytes += static_cast<char>(random());
  const std::string signature = "\x30\x82\n[update]\ncompatible=probebox-sim\nversion=" + version + "\n\n[bundle]\n";
  bytes += signature;
  for (int byte = 7; byte >= 0; --byte) bytes += static_cast<char>(signature.size() >> (8 * byte));
  std::ofstream{path, std::ios::binary} << bytes;
  return bytes;
}

}  // namespace probebox::support
