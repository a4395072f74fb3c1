#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// What is said to the service manager (systemd) that started this process. Nobody listens when a person did.
class ServiceManager {
 public:
  // How long it waits for feedWatchdog() before it restarts the process; nothing where it does not watch.
  std::optional<Nanoseconds> watchdog() const;

  void ready();
  void stopping();
  void feedWatchdog();
  // One line for `systemctl status`. The same line again is not sent again.
  void status(std::string_view text);

 private:
  std::string status_;
};

// A socket that the service manager opened for this process, and the name that its unit gives it.
struct PassedSocket {
  io::Descriptor descriptor;
  std::string name;
};
// Once: the sockets belong to the caller from then on.
std::vector<PassedSocket> takePassedSockets();

}  // namespace probebox::app
