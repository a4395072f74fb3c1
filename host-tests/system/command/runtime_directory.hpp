#pragma once
#include <filesystem>
#include <optional>
#include <stdlib.h>
#include <string>

#include "host-tests/support/temporary_folder.hpp"

namespace probebox::command {

// A rendezvous of its own (and a place for files) for the length of a test: it meets no other box of this computer.
class RuntimeDirectory {
 public:
  RuntimeDirectory() {
    if (const char* before = ::getenv(kVariable)) before_ = before;
    ::setenv(kVariable, rendezvous().c_str(), 1);
  }
  ~RuntimeDirectory() {
    if (before_) {
      ::setenv(kVariable, before_->c_str(), 1);
    } else {
      ::unsetenv(kVariable);
    }
  }
  RuntimeDirectory(const RuntimeDirectory&) = delete;
  RuntimeDirectory& operator=(const RuntimeDirectory&) = delete;

  const std::filesystem::path& path() const { return folder_.path(); }
  std::filesystem::path rendezvous() const { return path() / "rendezvous"; }
  std::string file(const std::string& name) const { return folder_.file(name); }

 private:
  static constexpr const char* kVariable = "PROBEBOX_RENDEZVOUS";
  support::TemporaryFolder folder_;
  std::optional<std::string> before_;
};

}  // namespace probebox::command
