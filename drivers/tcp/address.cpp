#include "drivers/tcp/address.hpp"

#include <arpa/inet.h>
#include <charconv>
#include <netinet/in.h>

namespace probebox::tcp {

Outcome<Address> parseAddress(std::string_view text) {
  const Error malformed{"'" + std::string{text} + "' is not a TCP address: write HOST:PORT, such as 127.0.0.1:7627"};
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos) return malformed;
  auto host = text.substr(0, colon);
  const auto digits = text.substr(colon + 1);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  if (!bracketed && host.find_first_of(":[]/ ") != std::string_view::npos) return malformed;

  Address address;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), address.port);
  if (error != std::errc{} || end != digits.data() + digits.size()) return malformed;
  if (!host.empty()) address.host = host;
  return address;
}

std::string describe(const Address& address) {
  const bool v6 = address.host.find(':') != std::string::npos;
  return (v6 ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

bool covers(const Address& listener, const Address& address) {
  const bool everywhere = listener.host == "0.0.0.0" || listener.host == "::";
  return listener.port == address.port && (everywhere || listener.host == address.host);
}

bool overlap(const Address& one, const Address& other) {
  const auto may_be = [](const Address& name, const Address& address) {
    return name.port == address.port && name.host == "localhost" &&
           (address.host == "127.0.0.1" || address.host == "::1");
  };
  return covers(one, other) || covers(other, one) || may_be(one, other) || may_be(other, one);
}

bool isLoopback(const Address& address) {
  if (address.host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, address.host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24U == IN_LOOPBACKNET;
  in6_addr v6{};
  return inet_pton(AF_INET6, address.host.c_str(), &v6) == 1 &&
         (IN6_IS_ADDR_LOOPBACK(&v6) || (IN6_IS_ADDR_V4MAPPED(&v6) && v6.s6_addr[12] == IN_LOOPBACKNET));
}

}  // namespace probebox::tcp
