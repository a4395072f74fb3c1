#include "protocol/units/plain_input.hpp"

#include <cerrno>
#include <cstring>
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

Outcome<std::ifstream> openPlainInput(const std::filesystem::path& path) {
  const auto cannot = [&](const std::string& why) { return Error{path.string() + ": cannot be read (" + why + ")"}; };
  if (const auto why = whyNoPlainInput(path)) return cannot(*why);
  std::ifstream file{path, std::ios::binary};
  if (!file) return cannot(std::strerror(errno));
  return file;
}

}  // namespace probebox
