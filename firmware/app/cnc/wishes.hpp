#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "firmware/app/results/reply.hpp"
#include "firmware/modbus/writable_registers.hpp"
#include "firmware/published/served_results.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Turns what a controller wants of runs and results into requests as hosts make them, and keeps the answer for its
// registers. Any thread.
class Wishes {
 public:
  using Ask = std::function<void(messages::Operation, std::vector<std::byte> body, std::function<void(Reply)> then)>;

  // by: in whose name results are accepted.
  Wishes(std::string by, Ask ask) : by_{std::move(by)}, ask_{std::move(ask)} {}

  void make(const modbus::Wish& wish);
  // What the registers show; a start is not done before the box shows the run.
  published::WishState state(std::uint32_t present_run) const;

 private:
  // Outlives this object where an answer comes late.
  struct Present {
    std::mutex mutex;
    published::WishState state;
    std::uint16_t commit{};  // of the request in hand
    bool starts{};
  };

  std::string by_;
  Ask ask_;
  std::shared_ptr<Present> present_{std::make_shared<Present>()};
};

}  // namespace probebox::app
