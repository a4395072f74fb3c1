#pragma once
#include <filesystem>
#include <sys/types.h>

namespace probebox::vm {

// The real systemd-udevd with a rule of this project installed, for as long as this lives.
class UdevDaemon {
 public:
  explicit UdevDaemon(const std::filesystem::path& rule);
  ~UdevDaemon();
  UdevDaemon(const UdevDaemon&) = delete;
  UdevDaemon& operator=(const UdevDaemon&) = delete;

 private:
  pid_t pid_{};
  std::filesystem::path installed_;
};

}  // namespace probebox::vm
