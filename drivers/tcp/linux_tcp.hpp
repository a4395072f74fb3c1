#pragma once
#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/io/descriptor.hpp"
#include "drivers/tcp/address.hpp"
#include "protocol/units/outcome.hpp"

// Connections without delay (TCP_NODELAY) and without signals: a peer that resets or vanishes shows as `closed`.
namespace probebox::tcp {

class Listener {
 public:
  // Port 0 lets the kernel choose. A port in use, or an address that is not of this machine, is an error with its
  // remedy.
  static Outcome<Listener> open(const Address& address);
  // A socket that somebody else bound and listens on, such as the service manager. `name` is for the error about one
  // that cannot accept hosts.
  static Outcome<Listener> adopt(io::Descriptor socket, std::string_view name);

  // The next host that waits, or null. Never blocks.
  std::unique_ptr<io::BytePipe> accept();

  int descriptor() const { return socket_.get(); }
  const Address& address() const { return address_; }  // with the port in use

 private:
  Listener(io::Descriptor socket, Address address) : socket_{std::move(socket)}, address_{std::move(address)} {}

  io::Descriptor socket_;
  Address address_;
};

// Waits at most `patience` for the connection.
Outcome<std::unique_ptr<io::BytePipe>> connectTcp(const Address& address, std::chrono::milliseconds patience);

}  // namespace probebox::tcp
