#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::tcp {

struct Address {
  std::string host{"127.0.0.1"};
  std::uint16_t port{};
};

// "HOST:PORT", ":PORT" (this machine) or "[IPv6]:PORT".
Outcome<Address> parseAddress(std::string_view text);
std::string describe(const Address& address);
// Tests whether a connection to `address` reaches a listener at `listener`: the same address, or all addresses of
// the machine.
bool covers(const Address& listener, const Address& address);
// Tests whether two listeners may want one port of one interface: the same address, all addresses beside one of them,
// or the name localhost beside an address that it may stand for.
bool overlap(const Address& one, const Address& other);

// Tests whether only this computer can reach a listener here: localhost, 127.0.0.0/8 or ::1. Other names count as
// reachable.
bool isLoopback(const Address& address);

}  // namespace probebox::tcp
