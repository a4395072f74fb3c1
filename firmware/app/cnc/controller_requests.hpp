#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "firmware/app/results/reply.hpp"
#include "firmware/modbus/writable_registers.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/served_results.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::app {

// Converts a controller's requests about runs and results to requests as from a host, and keeps the answer for its
// registers. Any thread.
class ControllerRequests {
 public:
  using Ask = std::function<void(messages::Operation, std::vector<std::byte> body, std::function<void(Reply)> then)>;

  // Tests whether an accepted result still waits for the end of a cut. Any thread.
  using Waits = std::function<bool(std::uint64_t result)>;

  // by: the name under which results are accepted.
  ControllerRequests(std::string by, Ask ask, Waits waits)
      : by_{std::move(by)}, ask_{std::move(ask)}, waits_{std::move(waits)} {}

  void make(const modbus::ControllerRequest& controller_request);
  // State for the registers. A start counts as done once the box shows the run, an abort once it shows its end.
  published::ControllerRequestState state(const published::Snapshot& shown) const;
  // Why requests were refused since the last call, in the words of `probebox calibrate`.
  std::vector<std::string> newRefusals();

 private:
  // Shared with pending answers, so it may outlive this object.
  struct Present {
    std::mutex mutex;
    published::ControllerRequestState state;
    std::uint16_t commit{};  // of the request in hand
    modbus::ControllerRequest::What what{};
    std::vector<std::string> refusals;  // not told yet
  };

  std::string by_;
  Ask ask_;
  Waits waits_;
  std::shared_ptr<Present> present_{std::make_shared<Present>()};
};

}  // namespace probebox::app
