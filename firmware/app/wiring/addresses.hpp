#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/describe/service.hpp"
#include "drivers/tcp/address.hpp"
#include "firmware/app/wiring/options.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Addresses of a run: those of the command line if it names any, else those of service.toml.
const std::vector<std::string>& linksOf(const Options& options, const board::Service& service);
const std::vector<std::string>& cncLinesOf(const Options& options, const board::Service& service);

// Explains what is wrong with these addresses, one problem per line, each with the place where it is written: no
// address, a path that is no serial line, a device used twice, a link that other computers reach and that is not
// read-only. Opens nothing, and accepts a device that is not there yet.
std::optional<Error> whyNoAddresses(const Options& options, const board::Service& service);

// The connection of service.toml for a listening socket that somebody else opened, or null.
const board::Connection* connectionOf(const tcp::Address& address, const board::Service& service);
// The first of these tls: links that a listening socket serves which somebody else opened; nullopt if there is none.
std::optional<tcp::Address> tlsLinkAt(const tcp::Address& listener, const std::vector<std::string>& links);
// The first of these links that a listening socket serves which somebody else opened; its own address if there is none.
tcp::Address linkAt(const tcp::Address& listener, const std::vector<std::string>& links);
// Name of the connection at a listener, as ConnectionInhibits has it. scheme: "tcp" or "tls". named: its address as
// service.toml has it.
std::string connectionNameOf(std::string_view scheme, const tcp::Address& named, const tcp::Address& listener);
// Tests whether a CNC line on the network is to be served at a listener.
bool isForCnc(const tcp::Address& listener, const std::vector<std::string>& cnc);

// Explains why a listener is refused: other computers reach it, hosts on a network cannot be identified, and its
// connection (null if service.toml has none) is not `read_only`. See docs/decisions/0009-connections.md.
std::optional<Error> whyOpenToAll(const tcp::Address& address, const board::Connection* connection);
// The same of a CNC line on the network, whose listener is at `address`.
std::optional<Error> whyOpenToMasters(const std::string& line, const tcp::Address& address,
                                      const board::Connection* connection);

}  // namespace probebox::app
