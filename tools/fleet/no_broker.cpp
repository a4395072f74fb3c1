#include "tools/fleet/broker.hpp"

namespace probebox::fleet {

bool Broker::isBuilt() {
  return false;
}

Outcome<std::unique_ptr<Broker>> Broker::open(const BrokerOptions&, const std::string&, const Message&) {
  return Error{"built without MQTT"};
}

}  // namespace probebox::fleet
