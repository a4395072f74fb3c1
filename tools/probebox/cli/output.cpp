#include "tools/probebox/cli/output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace probebox::command {
namespace {

namespace fs = std::filesystem;

// The file that a path means, which need not exist: a link stays, and what it points to is written.
std::string target(const std::string& path) {
  constexpr int kMostLinks = 40;
  std::error_code absent;
  fs::path file = path;
  for (int links = 0; links < kMostLinks && fs::is_symlink(file, absent); ++links)
    file = file.parent_path() / fs::read_symlink(file, absent);
  return file.string();
}

// A file that is not there yet, or one that can be replaced by another.
bool isReplaceable(const std::string& path) {
  std::error_code absent;
  return !fs::exists(path, absent) || fs::is_regular_file(path, absent);
}

// Empty where there is no current folder.
fs::path wholePath(const std::string& path) {
  std::error_code absent;
  return fs::weakly_canonical(fs::absolute(path, absent), absent);
}

// Renames a file unless there is one of the new name; errno says why it did not.
bool renameToNew(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  // A network file system may know hard links alone, a FUSE file system neither.
  if (::link(from.c_str(), to.c_str()) == 0) return ::unlink(from.c_str()) == 0;
  struct stat about {};
  if (::lstat(to.c_str(), &about) == 0) return errno = EEXIST, false;
  return std::rename(from.c_str(), to.c_str()) == 0;
}

// Makes an empty file unless there is one; errno says why it did not.
bool makeNew(const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "wbxe");
  return file != nullptr && std::fclose(file) == 0;
}

std::string madeMeanwhile(const std::string& path) {
  return path + " has been made meanwhile; name another file, or overwrite it with --force";
}

}  // namespace

Output::Output(std::string name, std::string written_to, std::unique_ptr<std::ostream> file, std::ostream* stream,
               bool replaces)
    : name_{std::move(name)},
      written_to_{std::move(written_to)},
      file_{std::move(file)},
      stream_{stream},
      replaces_{replaces} {}

Output::Output(Output&& other) noexcept
    : name_{std::move(other.name_)},
      written_to_{std::exchange(other.written_to_, {})},
      file_{std::move(other.file_)},
      stream_{other.stream_},
      replaces_{other.replaces_},
      is_late_{other.is_late_} {}

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
  const auto first = wholePath(a);
  return !first.empty() && first == wholePath(b);
}

std::optional<std::string> Output::objectionTo(const std::string& path, bool force) {
  if (path.empty()) return "the name of the file to write is empty: name one, or - for the standard output";
  std::error_code absent;
  if (force || path == "-" || !fs::is_regular_file(path, absent)) return std::nullopt;
  return path + " already exists; name another file, or overwrite it with --force";
}

Outcome<Output> Output::open(const std::string& path, bool force, std::ostream& standard, Appears appears) {
  if (path == "-") return Output{"the standard output", {}, nullptr, &standard, force};
  if (const auto objection = objectionTo(path, force)) return Error{*objection};
  const bool is_file = isReplaceable(path);
  const bool later = appears == Appears::when_whole && is_file;
  const std::string written_to = later ? target(path) + ".part-" + std::to_string(getpid()) : std::string{};
  if (is_file && !later && !force && !makeNew(target(path)))
    return Error{errno == EEXIST ? madeMeanwhile(path) : path + " cannot be written: " + std::strerror(errno)};
  auto file = std::make_unique<std::ofstream>(later ? written_to : path, std::ios::binary | std::ios::trunc);
  if (!*file) return Error{path + " cannot be written: " + std::strerror(errno)};
  auto* stream = file.get();
  return Output{path, written_to, std::move(file), stream, force};
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
  const auto to = target(name_);
  const bool renamed = replaces_ ? std::rename(written_to_.c_str(), to.c_str()) == 0 : renameToNew(written_to_, to);
  is_late_ = !renamed && !replaces_ && errno == EEXIST;
  if (renamed) written_to_.clear();
  if (!renamed) stream_->setstate(std::ios::badbit);
  return renamed;
}

std::string Output::failure() const {
  if (is_late_) return madeMeanwhile(name_);
  return name_ + " can no longer be written: the disk is full, or its reader has exited";
}

}  // namespace probebox::command
