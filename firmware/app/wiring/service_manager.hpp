#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// Sends notifications to the service manager (systemd) if it started this process.
class ServiceManager {
 public:
  // Watchdog time-out; nullopt without a watchdog.
  std::optional<Nanoseconds> watchdog() const;

  void ready();
  void stopping();
  void feedWatchdog();
  // One line for `systemctl status`; repeated lines are not sent.
  void status(std::string_view text);

 private:
  std::string status_;
};

// A socket that the service manager opened for this process, with the name from its unit.
struct PassedSocket {
  io::Descriptor descriptor;
  std::string name;
};
// Takes the sockets passed by the service manager. Call once: the caller owns them afterwards.
std::vector<PassedSocket> takePassedSockets();

}  // namespace probebox::app
