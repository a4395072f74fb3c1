#include "firmware/store/set_aside.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>

namespace probebox::store {
namespace {

bool areOneFile(const std::string& a, const std::string& b) {
  struct stat of_a {
  }, of_b{};
  return ::lstat(a.c_str(), &of_a) == 0 && ::lstat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

bool hasNoLinks(int error) {
  return error == EPERM || error == EOPNOTSUPP || error == ENOSYS || error == EMLINK || error == EXDEV;
}

bool keepAs(const std::string& path, const std::string& aside) {
  if (!isThere(path) || areOneFile(path, aside)) return true;
  if (::link(path.c_str(), aside.c_str()) == 0) return true;
  return hasNoLinks(errno) && std::rename(path.c_str(), aside.c_str()) == 0;
}

// The journal goes with its file: an expert may still get something out of the two together, and a new file must not
// find it.
bool moveCompanions(const std::string& path, const std::string& aside) {
  for (const char* companion : {"-journal", "-wal", "-shm"}) {
    if (std::rename((path + companion).c_str(), (aside + companion).c_str()) != 0 && errno != ENOENT) return false;
  }
  return true;
}

}  // namespace

bool isThere(const std::string& path) {
  struct stat about {};
  return ::lstat(path.c_str(), &about) == 0;
}

bool isStillAt(const std::string& path, int descriptor) {
  struct stat named {
  }, open{};
  return ::stat(path.c_str(), &named) == 0 && ::fstat(descriptor, &open) == 0 && named.st_dev == open.st_dev &&
         named.st_ino == open.st_ino;
}

bool isOrdinaryOrAbsent(const std::string& path) {
  struct stat about {};
  return ::stat(path.c_str(), &about) != 0 || S_ISREG(about.st_mode);
}

bool syncFolderOf(const std::string& path) {
  const auto folder = std::filesystem::path{path}.parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool synced = ::fsync(descriptor) == 0 || errno == EINVAL;
  const int why = errno;
  ::close(descriptor);
  errno = why;
  return synced;
}

std::string asideNameOf(const std::string& path, const std::string& reason) {
  for (int number = 1;; ++number) {
    std::string candidate = path + "." + reason + "-" + std::to_string(number);
    if (!isThere(candidate) || areOneFile(candidate, path)) return candidate;
  }
}

Outcome<void, Failure> putInPlace(const std::string& fresh, const std::string& path, const std::string& aside) {
  const bool is_kept = keepAs(path, aside) && syncFolderOf(path) && moveCompanions(path, aside) && syncFolderOf(path);
  if (is_kept && std::rename(fresh.c_str(), path.c_str()) == 0 && syncFolderOf(path)) return {};
  return Failure{Reason::unavailable, path + " cannot be moved aside (" + std::strerror(errno) +
                                          "); move it away by hand, or name another state directory"};
}

}  // namespace probebox::store
