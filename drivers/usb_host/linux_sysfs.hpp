#pragma once
#include <filesystem>
#include <string>

// What Linux tells about USB devices to users who may not open them.
namespace probebox::usb_host::sysfs {

// One line of /sys/bus/usb/devices/<path>/<name> ("serial", "product"); empty when there is none.
std::string attribute(const std::string& path, const std::string& name);

// First line of a file; empty when it cannot be read.
std::string firstLine(const std::filesystem::path& file);

inline constexpr const char* kDevices = "/sys/bus/usb/devices/";

// Whether udev runs here, and so tells libusb what comes and goes.
bool udevRuns();

}  // namespace probebox::usb_host::sysfs
