#include "firmware/app/wiring/service_manager.hpp"

#include <cstdint>
#include <cstdlib>
#include <systemd/sd-daemon.h>

namespace probebox::app {

std::optional<Nanoseconds> ServiceManager::watchdog() const {
  std::uint64_t period_us = 0;
  if (sd_watchdog_enabled(0, &period_us) <= 0) return std::nullopt;
  return std::chrono::microseconds{static_cast<std::int64_t>(period_us)};
}

void ServiceManager::ready() {
  sd_notify(0, "READY=1");
}
void ServiceManager::stopping() {
  sd_notify(0, "STOPPING=1");
}
void ServiceManager::feedWatchdog() {
  sd_notify(0, "WATCHDOG=1");
}

void ServiceManager::status(std::string_view text) {
  if (text == status_) return;
  status_ = text;
  sd_notify(0, ("STATUS=" + status_).c_str());
}

std::vector<PassedSocket> takePassedSockets() {
  char** names = nullptr;
  const int count = sd_listen_fds_with_names(1, &names);
  std::vector<PassedSocket> sockets;
  for (int i = 0; i < count; ++i) {
    sockets.push_back({io::Descriptor{SD_LISTEN_FDS_START + i}, names == nullptr ? "" : names[i]});
    if (names != nullptr) std::free(names[i]);
  }
  std::free(names);
  return sockets;
}

}  // namespace probebox::app
