#pragma once
#include "drivers/io/descriptor.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::tls {

// One descriptor that is readable for any of three reasons: the carrier has bytes, it has room again, or decrypted
// bytes wait that the kernel knows nothing of (epoll(7), eventfd(2)).
class Readiness {
 public:
  // carrier: stays open as long as this. Error: this process has no descriptor left.
  static Outcome<Readiness> watch(int carrier);

  int descriptor() const { return epoll_.get(); }
  void wantRoom(bool wanted);
  void bytesWait(bool waiting);

 private:
  Readiness(io::Descriptor epoll, int carrier) : epoll_{std::move(epoll)}, carrier_{carrier} {}

  io::Descriptor epoll_;
  int carrier_;
  bool wants_room_{};
  bool bytes_wait_{};
};

}  // namespace probebox::tls
