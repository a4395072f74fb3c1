#pragma once
#include <filesystem>
#include <stdlib.h>
#include <string>
#include <system_error>

namespace probebox::command {

// A private XDG_RUNTIME_DIR (and a place for files) for the length of a test.
class RuntimeDirectory {
 public:
  RuntimeDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "probebox-command-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
    if (const char* before = ::getenv("XDG_RUNTIME_DIR")) before_ = before;
    ::setenv("XDG_RUNTIME_DIR", path_.c_str(), 1);
  }
  ~RuntimeDirectory() {
    if (before_.empty()) {
      ::unsetenv("XDG_RUNTIME_DIR");
    } else {
      ::setenv("XDG_RUNTIME_DIR", before_.c_str(), 1);
    }
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  RuntimeDirectory(const RuntimeDirectory&) = delete;
  RuntimeDirectory& operator=(const RuntimeDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
  std::string before_;
};

}  // namespace probebox::command
