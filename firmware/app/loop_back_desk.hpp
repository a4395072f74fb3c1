#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "board/describe/box.hpp"
#include "board/describe/service.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "firmware/app/reply.hpp"

namespace probebox::app {

// Has the box pulse its own output, and says how late its kernel stamps edges. On the worker's thread: nothing that
// carries samples waits for it.
class LoopBackDesk {
 public:
  // `wire` is there where `lines` are.
  LoopBackDesk(board::Access access, std::optional<board::LoopBack> lines, std::unique_ptr<gpio::LoopBack> wire)
      : access_{access}, lines_{std::move(lines)}, wire_{std::move(wire)} {}

  Reply answer(std::span<const std::byte> body);

 private:
  board::Access access_;
  std::optional<board::LoopBack> lines_;
  std::unique_ptr<gpio::LoopBack> wire_;
};

}  // namespace probebox::app
