#include "board/describe/file_content.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "protocol/units/plain_input.hpp"

namespace probebox::board {

Outcome<std::string> fileContent(const std::filesystem::path& path, std::size_t most_bytes) {
  constexpr std::size_t kPart = 1'000'000;
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return Error{"it is a folder"};
  if (auto why = whyNoPlainInput(path)) return Error{std::move(*why)};
  errno = 0;
  std::ifstream in{path, std::ios::binary};
  std::string text;
  while (in && text.size() < most_bytes) {
    const auto had = text.size();
    text.resize(std::min(most_bytes, had + kPart));
    in.read(text.data() + had, static_cast<std::streamsize>(text.size() - had));
    text.resize(had + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad() || !in.is_open()) return Error{errno != 0 ? std::strerror(errno) : "it cannot be read"};
  return text;
}

}  // namespace probebox::board
