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
  // Port 0: chosen by the kernel. A port in use, or an address of another machine, is an error with its remedy.
  static Outcome<Listener> open(const Address& address);
  // Adopts a listening socket from another process, such as the service manager. `name`: for the error about an
  // unsuitable socket.
  static Outcome<Listener> adopt(io::Descriptor socket, std::string_view name);

  // The next waiting host, or null. Never blocks.
  std::unique_ptr<io::BytePipe> accept();

  int descriptor() const { return socket_.get(); }
  const Address& address() const { return address_; }  // with the actual port

 private:
  Listener(io::Descriptor socket, Address address) : socket_{std::move(socket)}, address_{std::move(address)} {}

  io::Descriptor socket_;
  Address address_;
};

// Waits at most `patience` for the connection.
Outcome<std::unique_ptr<io::BytePipe>> connectTcp(const Address& address, std::chrono::milliseconds patience);

}  // namespace probebox::tcp
