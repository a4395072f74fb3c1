#pragma once
#include <string>

#include "udev_daemon.hpp"

namespace probebox::vm {

// Devices belong to the box's group by the rule that ships, 60-probeboxd.rules, as long as this lives: those that are
// there, and those that are plugged in later.
class BoxRights {
 public:
  BoxRights();
  // Waits until udev has done what was asked of it.
  static void settle();

 private:
  UdevDaemon udev_;
};

}  // namespace probebox::vm
