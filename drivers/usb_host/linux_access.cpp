#include "drivers/usb_host/linux_access.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <unistd.h>

#include "drivers/usb_host/device.hpp"
#include "drivers/usb_host/linux_sysfs.hpp"

namespace probebox::usb_host {
namespace {

namespace fs = std::filesystem;
using sysfs::firstLine;
using sysfs::kDevices;

constexpr const char* kRule = "70-probebox.rules";
constexpr const char* kClaimedByAProgram = "usbfs";  // the kernel's driver for interfaces that programs have claimed

// The driver that is bound to the interface; empty when none is. An interface that nobody has claimed has none.
std::string driverOf(const Device& device) {
  std::error_code absent;
  const auto interface = device.path + ":" + firstLine(kDevices + device.path + "/bConfigurationValue") + "." +
                         std::to_string(device.interface_number);
  return fs::read_symlink(kDevices + interface + "/driver", absent).filename();
}

bool isNumber(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return c >= '0' && c <= '9'; });
}

bool holdsOpen(const fs::path& process, const std::string& node) {
  std::error_code error;
  for (auto fd = fs::directory_iterator{process / "fd", error}; !error && fd != fs::directory_iterator{};
       fd.increment(error)) {
    std::error_code gone;
    if (fs::read_symlink(fd->path(), gone) == node) return true;
  }
  return false;
}

// Another process that has the device open, as far as this user may look.
std::string processWith(const std::string& node) {
  std::error_code error;
  for (auto entry = fs::directory_iterator{"/proc", error}; !error && entry != fs::directory_iterator{};
       entry.increment(error)) {
    const std::string number = entry->path().filename();
    if (!isNumber(number) || number == std::to_string(::getpid()) || !holdsOpen(entry->path(), node)) continue;
    return firstLine(entry->path() / "comm") + " (process " + number + ")";
  }
  return "another program";
}

bool installed(const std::string& rule) {
  constexpr std::array kFolders{"/etc/udev/rules.d/", "/run/udev/rules.d/", "/usr/local/lib/udev/rules.d/",
                                "/usr/lib/udev/rules.d/", "/lib/udev/rules.d/"};
  return std::ranges::any_of(kFolders,
                             [&](const char* folder) { return ::access((folder + rule).c_str(), F_OK) == 0; });
}

}  // namespace

std::string_view nameOf(Access access) {
  switch (access) {
    case Access::busy:
      return "busy";
    case Access::no_permission:
      return "no permission";
    default:
      return "free";
  }
}

Access accessTo(const Device& device) {
  if (!driverOf(device).empty()) return Access::busy;
  return ::access(device.node.c_str(), R_OK | W_OK) == 0 ? Access::free : Access::no_permission;
}

std::string holderOf(const Device& device) {
  const auto driver = driverOf(device);
  if (driver.empty()) return {};
  return driver == kClaimedByAProgram ? processWith(device.node) : "the kernel's driver " + driver;
}

std::string remedyFor(Access access) {
  const std::string rule = kRule;
  switch (access) {
    case Access::no_permission:
      if (installed(rule)) {
        return rule +
               " gives access to the local user of this computer and to the group plugdev: log in locally, or join "
               "that group";
      }
      return "copy tools/link/" + rule + " to /etc/udev/rules.d, run `udevadm control --reload`, and plug it in again";
    case Access::busy:
      return "end that program, or unbind that driver, and try again";
    default:
      return {};
  }
}

}  // namespace probebox::usb_host
