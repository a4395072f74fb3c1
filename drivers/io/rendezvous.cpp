#include "drivers/io/rendezvous.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <signal.h>
#include <sstream>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace probebox::io::rendezvous {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxUriLength = 512;
constexpr std::size_t kMaxUris = 64;

// The directory below /tmp is taken only when it is ours: anyone may make one of that name before us.
bool ours(const fs::path& directory) {
  struct stat status {};
  return ::lstat(directory.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         (status.st_uid == ::geteuid() || status.st_uid == 0);
}

bool usable(const fs::path& directory) {
  if (::mkdir(directory.c_str(), 0755) != 0 && errno != EEXIST) return false;
  return ours(directory) && ::access(directory.c_str(), W_OK | X_OK) == 0;
}

std::string fileName(int pid) {
  return std::to_string(pid) + ".uri";
}

std::optional<int> pidOf(const fs::path& file) {
  if (file.extension() != ".uri") return std::nullopt;
  const std::string stem = file.stem().string();
  int pid = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), pid);
  if (error != std::errc{} || end != stem.data() + stem.size() || pid <= 0) return std::nullopt;
  return pid;
}

// EPERM: it exists and belongs to somebody else.
bool alive(int pid) {
  return ::kill(pid, 0) == 0 || errno == EPERM;
}

// Anybody may put anything there: what is no file of its own, such as a pipe or a link to a device, has no end.
std::vector<std::string> readLines(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(file, error))) return {};
  std::string text(kMaxUris * (kMaxUriLength + 1), '\0');
  std::ifstream whole{file, std::ios::binary};
  whole.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(whole.gcount()));
  std::istringstream in{text};
  std::vector<std::string> lines;
  for (std::string line; lines.size() < kMaxUris && std::getline(in, line);) {
    if (!line.empty() && line.size() <= kMaxUriLength) lines.push_back(line);
  }
  return lines;
}

}  // namespace

std::optional<fs::path> chosen() {
  const char* folder = std::getenv("PROBEBOX_RENDEZVOUS");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return fs::path{folder};
}

std::vector<fs::path> directories() {
  if (const auto folder = chosen()) return {*folder};
  std::vector<fs::path> all;
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime != nullptr && *runtime == '/') {
    all.push_back(fs::path{runtime} / "probebox");
  }
  all.emplace_back("/run/probebox");
  all.emplace_back("/tmp/probebox-" + std::to_string(::geteuid()));
  return all;
}

Outcome<fs::path> directory() {
  const auto all = directories();
  if (const auto found = std::find_if(all.begin(), all.end(), usable); found != all.end()) return *found;
  std::string names;
  for (const auto& path : all) names += (names.empty() ? "" : ", ") + path.string();
  return Error{"no directory to announce this box in can be written (" + names + "); set " +
               (chosen() ? "PROBEBOX_RENDEZVOUS" : "XDG_RUNTIME_DIR") + " to one that can"};
}

Outcome<fs::path> announce(int pid, const std::vector<std::string>& uris) {
  TRY(const auto where, directory());
  const fs::path file = where / fileName(pid);
  const fs::path unfinished = where / (fileName(pid) + ".new");
  {
    std::ofstream out{unfinished, std::ios::trunc};
    for (const auto& uri : uris) out << uri << '\n';
    out.close();
    if (!out) return Error{unfinished.string() + " cannot be written; is the disk full?"};
  }
  std::error_code error;
  // An invitation is for all, however private the daemon keeps its other files.
  fs::permissions(unfinished, fs::perms{0644}, error);
  if (!error) fs::rename(unfinished, file, error);
  if (error) return Error{file.string() + " cannot be written: " + error.message()};
  return file;
}

void withdraw(int pid) {
  std::error_code ignored;  // a file that is not there needs no removing
  for (const auto& path : directories()) fs::remove(path / fileName(pid), ignored);
}

std::vector<Announcement> listed() {
  std::vector<Announcement> found;
  for (const auto& path : directories()) {
    if (path.parent_path() == "/tmp" && !ours(path)) continue;
    std::error_code error;
    for (auto entry = fs::directory_iterator{path, error}; !error && entry != fs::directory_iterator{};
         entry.increment(error)) {
      const auto pid = pidOf(entry->path());
      if (pid && alive(*pid)) found.push_back({*pid, readLines(entry->path())});
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.pid < b.pid; });
  return found;
}

}  // namespace probebox::io::rendezvous
