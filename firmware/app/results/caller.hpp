#pragma once
#include <cstdint>
#include <string>

#include "board/describe/service.hpp"

namespace probebox::app {

// Who asks.
struct Caller {
  std::uint64_t link{};  // where the answer goes
  std::string door;      // what the link came in through, as DoorBook names it
  board::Access may;
};

}  // namespace probebox::app
