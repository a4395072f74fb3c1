#include "drivers/tls/linux_readiness.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <utility>

namespace probebox::tls {
namespace {

// Always readable, and shared by all connections: each watches it while its bytes wait.
int alwaysReadable() {
  static const io::Descriptor event{eventfd(1, EFD_CLOEXEC | EFD_NONBLOCK)};
  return event.get();
}

int control(int epoll, int operation, int descriptor, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  return epoll_ctl(epoll, operation, descriptor, &event);
}

}  // namespace

Outcome<Readiness> Readiness::watch(int carrier) {
  io::Descriptor epoll{epoll_create1(EPOLL_CLOEXEC)};
  if (!epoll || control(epoll.get(), EPOLL_CTL_ADD, carrier, EPOLLIN) != 0 ||
      control(epoll.get(), EPOLL_CTL_ADD, alwaysReadable(), 0) != 0) {
    return Error{std::string{"A TLS connection cannot be watched ("} + std::strerror(errno) +
                 "): let this process open more files (ulimit -n)"};
  }
  return Readiness{std::move(epoll), carrier};
}

void Readiness::wantRoom(bool wanted) {
  if (std::exchange(wants_room_, wanted) == wanted) return;
  control(epoll_.get(), EPOLL_CTL_MOD, carrier_, wanted ? std::uint32_t{EPOLLIN} | EPOLLOUT : EPOLLIN);
}

void Readiness::bytesWait(bool waiting) {
  if (std::exchange(bytes_wait_, waiting) == waiting) return;
  control(epoll_.get(), EPOLL_CTL_MOD, alwaysReadable(), waiting ? std::uint32_t{EPOLLIN} : 0U);
}

}  // namespace probebox::tls
