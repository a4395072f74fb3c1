#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/tcp/address.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::fleet {

struct BrokerOptions {
  tcp::Address address;
  std::string ca, certificate, key;  // files, PEM; all empty: no TLS
};

// A topic and what it holds.
struct Message {
  std::string topic;
  std::string payload;
};

// A connection to an MQTT broker, which comes back by itself. No call waits for it.
class Broker {
 public:
  // False where libmosquitto was not installed when this program was built.
  static bool isBuilt();
  // client: names this client, the same at each start. last_will: the broker publishes it, retained, when the
  // connection ends without a word. Error: a file that TLS does not take.
  static Outcome<std::unique_ptr<Broker>> open(const BrokerOptions& options, const std::string& client,
                                               const Message& last_will);

  virtual ~Broker() = default;
  virtual bool connected() const = 0;
  // Number of connections so far.
  virtual unsigned connections() const = 0;
  // Why there is no connection; empty while there is one, and before the first attempt.
  virtual std::string problem() const = 0;
  // QoS 0, retained: what is lost is replaced by the next one.
  virtual void publishState(const Message& message) = 0;
  // QoS 1. Returns the number by which the broker acknowledges it. It is sent again, as a duplicate, when the
  // connection breaks before that. Nothing: it was not taken.
  virtual std::optional<int> publish(const Message& message) = 0;
  // Numbers acknowledged since the last call.
  virtual std::vector<int> acknowledged() = 0;
};

}  // namespace probebox::fleet
