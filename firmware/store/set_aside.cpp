#include "firmware/store/set_aside.hpp"

#include <filesystem>
#include <system_error>

namespace probebox::store {
namespace {

namespace fs = std::filesystem;

std::string freeName(const std::string& path, const std::string& reason) {
  for (int number = 1;; ++number) {
    const std::string candidate = path + "." + reason + "-" + std::to_string(number);
    if (std::error_code error; !fs::exists(fs::symlink_status(candidate, error))) return candidate;
  }
}

}  // namespace

// The journal goes with its file: an expert may still get something out of the two together.
Outcome<std::string, Failure> setAside(const std::string& path, const std::string& reason) {
  const std::string aside = freeName(path, reason);
  std::error_code error;
  fs::rename(path, aside, error);
  if (error) {
    return Failure{Reason::unavailable, path + " is " + reason + " and cannot be moved aside (" + error.message() +
                                            "); move it away by hand, or name another state directory"};
  }
  for (const char* companion : {"-journal", "-wal", "-shm"}) {
    std::error_code absent;
    fs::rename(path + companion, aside + companion, absent);
  }
  return aside;
}

}  // namespace probebox::store
