#include "udev_daemon.hpp"

#include <chrono>
#include <signal.h>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace probebox::vm {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr const char* kControl = "/run/udev/control";

}  // namespace

UdevDaemon::UdevDaemon(const fs::path& rule) : installed_{"/etc/udev/rules.d" / rule.filename()} {
  fs::create_directories(installed_.parent_path());
  fs::copy_file(rule, installed_, fs::copy_options::overwrite_existing);
  std::string program = "/lib/systemd/systemd-udevd";
  std::string patience = "--event-timeout=3600";  // of a guest whose time leaps while it waits for this machine's files
  char* const words[] = {program.data(), patience.data(), nullptr};
  if (::posix_spawn(&pid_, program.c_str(), nullptr, nullptr, words, environ) != 0) {
    throw std::runtime_error{program + " does not start"};
  }
  for (int round = 0; !fs::exists(kControl); ++round) {
    if (round > 1000) throw std::runtime_error{program + " is not ready"};
    std::this_thread::sleep_for(20ms);
  }
}

UdevDaemon::~UdevDaemon() {
  ::kill(pid_, SIGTERM);
  ::waitpid(pid_, nullptr, 0);
  std::error_code ignored;
  fs::remove(kControl, ignored);
  fs::remove(installed_, ignored);
}

}  // namespace probebox::vm
