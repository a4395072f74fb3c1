#include "protocol/units/plain_input.hpp"

#include <system_error>

namespace probebox {

std::optional<std::string> whyNoPlainInput(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code unknown;
  const auto kind = fs::status(path, unknown).type();
  if (kind == fs::file_type::character || kind == fs::file_type::block) return "it is a device, not a file";
  if (kind == fs::file_type::socket) return "it is a socket, not a file";
  if (kind != fs::file_type::fifo) return std::nullopt;
  const bool named = !fs::canonical(path, unknown).empty();
  if (!named) return std::nullopt;  // as of /dev/fd/63: a program has its other end
  return "it is a pipe, not a file";
}

}  // namespace probebox
