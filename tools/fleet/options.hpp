#pragma once
#include <optional>
#include <string>

#include "drivers/tcp/address.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/fleet/broker.hpp"

namespace CLI {
class App;
}

namespace probebox::fleet {

struct Options {
  std::string uri;     // of the box; empty: PROBEBOX_URI, or the only one there is
  std::string listen;  // HOST:PORT; empty: the socket of the service manager, or no metrics
  std::string mqtt;    // HOST:PORT of the broker; empty: none
  std::string ca, certificate, key;
  std::string state;  // folder
  double state_every_s{10};
};

// CLI11 is slow to compile: only options.cpp, the program and the writer of pages include it.
void declareOptions(CLI::App& command, Options& options);

// Errors, with the remedy: a build without MQTT, an address that is none, MQTT without TLS over a network, TLS without
// all of its files.
Outcome<std::optional<BrokerOptions>> brokerOf(const Options& options);

}  // namespace probebox::fleet
