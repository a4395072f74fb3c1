#pragma once
#include <filesystem>
#include <string>

// Information of Linux about USB devices that needs no permission.
namespace probebox::usb_host::sysfs {

// One line of /sys/bus/usb/devices/<path>/<name> ("serial", "product"); empty if missing.
std::string attribute(const std::string& path, const std::string& name);

// First line of a file; empty if unreadable.
std::string firstLine(const std::filesystem::path& file);

inline constexpr const char* kDevices = "/sys/bus/usb/devices/";

// Tests whether udev runs, so libusb gets hot-plug events.
bool udevRuns();

}  // namespace probebox::usb_host::sysfs
