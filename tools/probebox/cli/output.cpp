#include "tools/probebox/cli/output.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace probebox::command {
namespace {

namespace fs = std::filesystem;

// The file that a path means: a link stays, and what it points to is replaced.
std::string target(const std::string& path) {
  std::error_code absent;
  return fs::is_symlink(path, absent) ? fs::weakly_canonical(path, absent).string() : path;
}

// A file that is not there yet, or one that can be replaced by another.
bool isReplaceable(const std::string& path) {
  std::error_code absent;
  return !fs::exists(path, absent) || fs::is_regular_file(path, absent);
}

}  // namespace

Output::Output(std::string name, std::string written_to, std::unique_ptr<std::ostream> file, std::ostream* stream)
    : name_{std::move(name)}, written_to_{std::move(written_to)}, file_{std::move(file)}, stream_{stream} {}

Output::Output(Output&& other) noexcept
    : name_{std::move(other.name_)},
      written_to_{std::exchange(other.written_to_, {})},
      file_{std::move(other.file_)},
      stream_{other.stream_} {}

Output::~Output() {
  if (written_to_.empty()) return;
  file_.reset();
  std::error_code gone;
  fs::remove(written_to_, gone);
}

bool Output::isSameFile(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty() || a == "-" || b == "-") return false;
  std::error_code absent;
  if (fs::equivalent(a, b, absent)) return true;
  const auto first = fs::weakly_canonical(fs::absolute(a), absent),
             second = fs::weakly_canonical(fs::absolute(b), absent);
  return !first.empty() && first == second;
}

std::optional<std::string> Output::objectionTo(const std::string& path, bool force) {
  if (path.empty()) return "the name of the file to write is empty: name one, or - for the standard output";
  std::error_code absent;
  if (force || path == "-" || !fs::is_regular_file(path, absent)) return std::nullopt;
  return path + " already exists; name another file, or overwrite it with --force";
}

Outcome<Output> Output::open(const std::string& path, bool force, std::ostream& standard, Appears appears) {
  if (path == "-") return Output{"the standard output", {}, nullptr, &standard};
  if (const auto objection = objectionTo(path, force)) return Error{*objection};
  const bool later = appears == Appears::when_whole && isReplaceable(path);
  const std::string written_to = later ? target(path) + ".part-" + std::to_string(getpid()) : std::string{};
  auto file = std::make_unique<std::ofstream>(later ? written_to : path, std::ios::binary | std::ios::trunc);
  if (!*file) return Error{path + " cannot be written: " + std::strerror(errno)};
  auto* stream = file.get();
  return Output{path, written_to, std::move(file), stream};
}

bool Output::write(std::string_view text) {
  stream_->write(text.data(), static_cast<std::streamsize>(text.size()));
  return stream_->good();
}

bool Output::flush() {
  stream_->flush();
  return stream_->good();
}

bool Output::finish() {
  if (!flush()) return false;
  if (written_to_.empty()) return true;
  std::error_code error;
  fs::rename(written_to_, target(name_), error);
  if (error) stream_->setstate(std::ios::badbit);
  if (!error) written_to_.clear();
  return !error;
}

std::string Output::failure() const {
  return name_ + " can no longer be written: the disk is full, or its reader has exited";
}

}  // namespace probebox::command
