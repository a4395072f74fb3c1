#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "board/describe/service.hpp"

namespace probebox::app {

// The sender of a request.
struct Caller {
  std::uint64_t link{};    // gets the answer
  std::string connection;  // connection of the link, as ConnectionInhibits names it
  board::Access may;
  std::optional<std::string> person{};  // whom the link's certificate names; nullopt where a link proves nobody
};

}  // namespace probebox::app
