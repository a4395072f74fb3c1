#include "tools/probebox/cli/output.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace probebox::command {

std::optional<std::string> Output::objectionTo(const std::string& path, bool force) {
  std::error_code absent;
  if (force || path == "-" || !std::filesystem::is_regular_file(path, absent)) return std::nullopt;
  return path + " already exists; name another file, or overwrite it with --force";
}

Outcome<Output> Output::open(const std::string& path, bool force, std::ostream& standard) {
  if (path == "-") return Output{"the standard output", nullptr, &standard};
  if (const auto objection = objectionTo(path, force)) return Error{*objection};
  auto file = std::make_unique<std::ofstream>(path, std::ios::binary | std::ios::trunc);
  if (!*file) return Error{path + " cannot be written: " + std::strerror(errno)};
  auto* stream = file.get();
  return Output{path, std::move(file), stream};
}

bool Output::write(std::string_view text) {
  stream_->write(text.data(), static_cast<std::streamsize>(text.size()));
  return stream_->good();
}

bool Output::flush() {
  stream_->flush();
  return stream_->good();
}

std::string Output::failure() const {
  return name_ + " can no longer be written: the disk is full, or its reader has exited";
}

}  // namespace probebox::command
