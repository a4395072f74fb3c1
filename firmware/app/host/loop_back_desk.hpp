#pragma once
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "board/describe/box.hpp"
#include "board/describe/service.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "firmware/app/results/reply.hpp"

namespace probebox::app {

// Has the box pulse its own output, and says how late its kernel stamps edges. On the worker's thread: nothing that
// carries samples waits for it. It takes up to 3 s, so there is one measurement at a time.
class LoopBackDesk {
 public:
  // `wire` is there where `lines` are.
  LoopBackDesk(board::Access access, std::optional<board::LoopBack> lines, std::unique_ptr<gpio::LoopBack> wire)
      : access_{access}, lines_{std::move(lines)}, wire_{std::move(wire)} {}

  // The thread of the links: false while a measurement waits or goes on; else answer() has to follow, or end().
  bool begin() { return !busy_.exchange(true); }
  void end() { busy_ = false; }

  Reply answer(std::span<const std::byte> body);

 private:
  Reply measured(std::span<const std::byte> body);

  std::atomic<bool> busy_{};
  board::Access access_;
  std::optional<board::LoopBack> lines_;
  std::unique_ptr<gpio::LoopBack> wire_;
};

}  // namespace probebox::app
