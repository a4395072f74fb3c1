#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "protocol/messages/control.hpp"
#include "tools/fleet/broker.hpp"
#include "tools/fleet/metrics/box_metrics.hpp"
#include "tools/fleet/queue/outbox.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::fleet {

// Brings state, results and history of one box to a broker, under probebox/v1/SERIAL/: state (QoS 0, retained, the
// newest only; "up": false when the box or this process is gone), result/N and history/N (QoS 1, in the order of the
// history). What may have come before has "again": true. A result that the box cannot tell has its "problem" in place
// of values.
class Publisher {
 public:
  // folder: of the outboxes, one for each box.
  Publisher(BrokerOptions options, std::string folder, command::Console& console)
      : options_{std::move(options)}, folder_{std::move(folder)}, console_{console} {}

  // To be called often; never waits for the broker. box: null while none answers. Trouble: of the link to the box.
  std::optional<command::Trouble> round(link::Client* box, MonoTime now);
  // Replaces the retained state. box: null: it does not answer.
  void publishState(const Observed* box);
  // True after a connection to the broker, until publishState(): the broker may have kept a state of before.
  bool wantsState() const { return broker_ && broker_->connected() && broker_->connections() != told_state_; }
  void addMetrics(Exposition& to) const;

 private:
  void open(const std::string& serial_number);
  void openBroker();
  std::optional<command::Trouble> compareHistories(link::Client& box);
  std::optional<command::Trouble> fetch(link::Client& box);
  std::optional<command::Trouble> sendNext(link::Client& box, MonoTime now);
  std::string topic(const std::string& of) const;
  void say(const std::string& what);
  void sayConnection();

  BrokerOptions options_;
  std::string folder_;
  command::Console& console_;
  std::string serial_number_;  // of the box that the following are about
  std::unique_ptr<Broker> broker_;
  std::optional<Outbox> outbox_;
  std::optional<messages::BootId> compared_with_;  // the box whose history is known to be the one that was published
  std::deque<messages::ResultTransition> next_;
  MonoTime asked_{}, opened_{}, not_before_{};
  int tries_{};                // to fetch the result of next_.front()
  std::uint64_t half_sent_{};  // the entry whose result was taken, and which itself may not have been
  unsigned told_state_{};
  std::string said_, said_connection_;
};

}  // namespace probebox::fleet
