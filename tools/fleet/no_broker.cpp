#include "tools/fleet/broker.hpp"

namespace probebox::fleet {

Outcome<std::unique_ptr<Broker>> Broker::open(const BrokerOptions&, const std::string&, const Message&) {
  return Error{
      "this program was built without MQTT: install libmosquitto-dev, configure and build again, or leave out --mqtt"};
}

}  // namespace probebox::fleet
