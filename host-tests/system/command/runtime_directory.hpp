#pragma once
#include <filesystem>
#include <stdlib.h>
#include <string>

#include "host-tests/support/temporary_folder.hpp"

namespace probebox::command {

// A private XDG_RUNTIME_DIR (and a place for files) for the length of a test.
class RuntimeDirectory {
 public:
  RuntimeDirectory() {
    if (const char* before = ::getenv("XDG_RUNTIME_DIR")) before_ = before;
    ::setenv("XDG_RUNTIME_DIR", path().c_str(), 1);
  }
  ~RuntimeDirectory() {
    if (before_.empty()) {
      ::unsetenv("XDG_RUNTIME_DIR");
    } else {
      ::setenv("XDG_RUNTIME_DIR", before_.c_str(), 1);
    }
  }
  RuntimeDirectory(const RuntimeDirectory&) = delete;
  RuntimeDirectory& operator=(const RuntimeDirectory&) = delete;

  const std::filesystem::path& path() const { return folder_.path(); }
  std::string file(const std::string& name) const { return folder_.file(name); }

 private:
  support::TemporaryFolder folder_;
  std::string before_;
};

}  // namespace probebox::command
