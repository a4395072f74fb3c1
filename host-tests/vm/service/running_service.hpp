#pragma once
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <thread>

#include "installed_box.hpp"
#include "kernel_files.hpp"

namespace probebox::vm {

// Where hosts come in: the listener of the socket unit.
inline constexpr const char* kConnection = "tcp:127.0.0.1:7627";

// The installed service, running.
class Service : public testing::Test {
 protected:
  void SetUp() override { shell("systemctl start probeboxd.service"); }

  void TearDown() override {
    if (HasFailure()) std::printf("%s\n", InstalledBox::log().c_str());
  }

  static std::filesystem::path proc() { return "/proc/" + std::to_string(InstalledBox::pid()); }
  // The folder of the daemon's thread in /proc.
  static std::filesystem::path threadFolder(const std::string& name) {
    for (const auto& task : std::filesystem::directory_iterator{proc() / "task"}) {
      if (readFrom(task.path() / "comm") == name) return task.path();
    }
    return {};
  }
  static bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 1200; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds{100});
    }
    return false;
  }
  // systemd has given up the process and started another.
  static bool replaced(int pid) {
    return eventually([&] { return InstalledBox::pid() > 0 && InstalledBox::pid() != pid; }) &&
           eventually([] { return InstalledBox::property("SubState") == "running"; });
  }

  InstalledBox& box = InstalledBox::instance();
};

}  // namespace probebox::vm
