#include "box_rights.hpp"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "box_user.hpp"

namespace probebox::vm {
namespace {

void shell(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error{"failed: " + command};
}

// The rule names the group that the package makes.
const char* withGroup(const char* rule) {
  std::ofstream{"/etc/group", std::ios::app} << "probebox:x:" << kBoxGroup << ":\n";
  return rule;
}

}  // namespace

BoxRights::BoxRights() : udev_{withGroup(PROBEBOXD_RULE)} {
  // udevadm would leave a chroot alone, which the root of a guest is.
  shell(
      "SYSTEMD_IGNORE_CHROOT=1 udevadm trigger --action=add --subsystem-match=counter --subsystem-match=iio "
      "--subsystem-match=gpio");
  settle();
}

void BoxRights::settle() {
  // A guest whose time leaps may have waited minutes for this machine's files.
  shell("SYSTEMD_IGNORE_CHROOT=1 udevadm settle --timeout=3600");
}

}  // namespace probebox::vm
