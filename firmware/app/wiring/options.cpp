#include "firmware/app/wiring/options.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <string_view>
#include <sys/file.h>
#include <system_error>
#include <utility>

namespace probebox::app {
namespace {

std::filesystem::path fromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::filesystem::path{} : std::filesystem::path{value};
}

std::filesystem::path usualStateDirectory() {
  if (auto path = fromEnvironment("STATE_DIRECTORY"); !path.empty()) return path;
  if (auto path = fromEnvironment("XDG_STATE_HOME"); !path.empty()) return path / "probebox";
  if (auto path = fromEnvironment("HOME"); !path.empty()) return path / ".local/state/probebox";
  return "/var/lib/probebox";
}

// As opposed to a name that is wrong, or rights that are missing.
bool isTheDisks(int error) {
  return error == ENOSPC || error == EDQUOT || error == EROFS || error == EIO;
}

}  // namespace

Outcome<LinkAddress> parseLink(const std::string& text) {
  const std::string_view view{text};
  if (view.starts_with("tcp:")) {
    TRY(auto address, tcp::parseAddress(view.substr(4)));
    return LinkAddress{address};
  }
  if (view.starts_with("tls:")) {
    TRY(auto address, tcp::parseAddress(view.substr(4)));
    return LinkAddress{TlsAddress{std::move(address)}};
  }
  if (view.starts_with("serial:")) {
    TRY(auto address, serial::parseAddress(view.substr(7), serial::kHostLink));
    if (auto refused = serial::whyNoHostLink(address)) return *std::move(refused);
    return LinkAddress{address};
  }
  if (view == "usb" || view.starts_with("usb:")) {
    TRY(auto address, usb_gadget::parsePort(view.substr(3)));
    return LinkAddress{address};
  }
  return Error{"The link '" + text +
               "' is neither tcp:HOST:PORT nor tls:HOST:PORT nor serial:DEVICE[,baud=921600] nor usb."};
}

std::filesystem::path stateDirectory(const std::filesystem::path& chosen) {
  return chosen.empty() ? usualStateDirectory() : chosen;
}

Outcome<StateDirectory> takeStateDirectory(const std::filesystem::path& chosen) {
  const auto path = stateDirectory(chosen);
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) {
    const std::string what = "The folder " + path.string() + " for results cannot be made (" + error.message() + "): ";
    if (isTheDisks(error.value())) return StateDirectory{path, {}, what + "nothing is kept."};
    return Error{what + "name another with --state."};
  }
  // The folder itself is the lock: it needs no space, and no right to write.
  io::Descriptor lock{open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (!lock) {
    return Error{"The folder " + path.string() + " for results cannot be read (" + std::strerror(errno) +
                 "): name another with --state."};
  }
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{"Another probeboxd works with the folder " + path.string() +
                 ": stop that one, or name another folder with --state."};
  }
  return StateDirectory{path, std::move(lock)};
}

Earlier earlierIn(const std::filesystem::path& state) {
  const auto has = [&](const char* file) { return store::isThere((state / file).string()); };
  const auto had = [](bool it) { return it ? store::Before::had_it : store::Before::perhaps; };
  return {.start = had(has(kBootsFile)), .files = had(has("connections") || has("served") || has("results.db"))};
}

}  // namespace probebox::app
