#include "drivers/usb_host/linux_sysfs.hpp"

#include <fstream>
#include <unistd.h>

namespace probebox::usb_host::sysfs {

std::string firstLine(const std::filesystem::path& file) {
  std::ifstream in{file};
  std::string line;
  std::getline(in, line);
  return line;
}

std::string attribute(const std::string& path, const std::string& name) {
  return firstLine(kDevices + path + "/" + name);
}

bool udevRuns() {
  return ::access("/run/udev/control", F_OK) == 0;
}

}  // namespace probebox::usb_host::sysfs
