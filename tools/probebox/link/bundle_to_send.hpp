#pragma once
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "protocol/messages/updates.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

// A RAUC bundle on this computer: a squashfs, its signature (CMS), and 8 bytes with the signature's size. Only the box
// knows whose signatures it trusts.
class BundleToSend {
 public:
  // Trouble: the file is no bundle; says what it is where that can be seen.
  static Outcome<BundleToSend, Trouble> open(const std::string& path);

  const std::string& name() const { return name_; }
  // Version stated in the manifest, for a person; empty if it cannot be read.
  const std::string& version() const { return version_; }
  std::uint64_t bytes() const { return bytes_; }
  const messages::Sha256& sha256() const { return sha256_; }
  // Fewer at the end of the file, or where it has changed meanwhile.
  std::vector<std::byte> part(std::uint64_t offset, std::size_t count);

 private:
  BundleToSend() = default;

  std::ifstream file_;
  std::string name_;
  std::string version_;
  std::uint64_t bytes_{};
  messages::Sha256 sha256_{};
};

}  // namespace probebox::command
