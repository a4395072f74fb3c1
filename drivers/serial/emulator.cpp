#include "drivers/serial/emulator.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <utility>

namespace probebox::serial {
namespace {

// As much as a serial driver holds; more would let a reader that stalls go unnoticed.
constexpr std::size_t kBufferBytes = 65536;

void makeRaw(int fd) {
  termios line{};
  tcgetattr(fd, &line);
  cfmakeraw(&line);
  tcsetattr(fd, TCSANOW, &line);
}

}  // namespace

Outcome<EmulatedCable> EmulatedCable::open(std::filesystem::path port_a, std::filesystem::path port_b) {
  EmulatedCable cable;
  cable.ports_[0].link = std::move(port_a);
  cable.ports_[1].link = std::move(port_b);
  for (const auto end : {End::a, End::b}) {
    TRY(cable.plug(end));
  }
  return cable;
}

EmulatedCable::~EmulatedCable() {
  for (auto& port : ports_) {
    std::error_code ignored;
    if (port.controller) std::filesystem::remove(port.link, ignored);
  }
}

Outcome<void> EmulatedCable::plug(End end) {
  auto& port = ports_[static_cast<std::size_t>(end)];
  io::Descriptor controller{posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
  std::array<char, 64> name{};
  if (!controller || grantpt(controller.get()) != 0 || unlockpt(controller.get()) != 0 ||
      ptsname_r(controller.get(), name.data(), name.size()) != 0) {
    return Error{std::string{"no pseudo terminal available: "} + std::strerror(errno)};
  }
  io::Descriptor device{::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC)};
  if (!device) return Error{std::string{name.data()} + ": " + std::strerror(errno)};
  makeRaw(device.get());

  std::error_code error;
  // Only a link that an earlier cable left behind may be replaced.
  if (std::filesystem::is_symlink(port.link)) std::filesystem::remove(port.link, error);
  std::filesystem::create_symlink(name.data(), port.link, error);
  if (error) return Error{port.link.string() + ": " + error.message() + "; choose another name for the port"};
  port.controller = std::move(controller);
  port.device = std::move(device);
  return {};
}

void EmulatedCable::unplug(End end) {
  auto& port = ports_[static_cast<std::size_t>(end)];
  std::error_code ignored;
  if (port.controller) std::filesystem::remove(port.link, ignored);
  port.device.close();
  port.controller.close();
  port.waiting.clear();
}

std::size_t EmulatedCable::pump(std::chrono::milliseconds patience) {
  std::array<pollfd, 2> waits{};
  for (std::size_t i = 0; i < 2; ++i) {
    const bool room = ports_[1 - i].waiting.size() < kBufferBytes;
    const auto events = (room && !stalled_ ? POLLIN : 0) | (ports_[i].waiting.empty() || stalled_ ? 0 : POLLOUT);
    waits[i] = {ports_[i].controller.get(), static_cast<short>(events), 0};
  }
  if (poll(waits.data(), waits.size(), static_cast<int>(patience.count())) <= 0 || stalled_) return 0;
  collect(ports_[0], ports_[1]);
  collect(ports_[1], ports_[0]);
  return deliver(ports_[0]) + deliver(ports_[1]);
}

void EmulatedCable::inject(End at, std::span<const std::byte> noise) {
  auto& port = ports_[static_cast<std::size_t>(at)];
  port.waiting.insert(port.waiting.end(), noise.begin(), noise.end());
  deliver(port);
}

void EmulatedCable::collect(Port& from, Port& to) {
  if (!from.controller || to.waiting.size() >= kBufferBytes) return;
  std::array<std::byte, 4096> buffer{};
  const auto bytes = ::read(from.controller.get(), buffer.data(), buffer.size());
  if (bytes > 0 && from.echoes) from.waiting.insert(from.waiting.end(), buffer.begin(), buffer.begin() + bytes);
  // With the far end unplugged the wire leads nowhere.
  if (bytes > 0 && to.controller) to.waiting.insert(to.waiting.end(), buffer.begin(), buffer.begin() + bytes);
}

std::size_t EmulatedCable::deliver(Port& to) {
  if (!to.controller || to.waiting.empty()) return 0;
  const auto bytes = ::write(to.controller.get(), to.waiting.data(), to.waiting.size());
  if (bytes <= 0) return 0;
  to.waiting.erase(to.waiting.begin(), to.waiting.begin() + bytes);
  return static_cast<std::size_t>(bytes);
}

}  // namespace probebox::serial
