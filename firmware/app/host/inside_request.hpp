#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "board/describe/service.hpp"
#include "firmware/app/results/reply.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// A request that comes in through a controller's line. It is handled as a host's, with the same rights and refusals.
struct InsideRequest {
  std::string connection;  // as ConnectionInhibits names it
  board::Access may;
  messages::Operation operation{};
  std::vector<std::byte> body;
  std::function<void(Reply)> then;  // called once on the thread of the links, or never if the box stops before
};

}  // namespace probebox::app
