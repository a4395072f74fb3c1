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

// Pulses the box's own output and measures the latency of its edge stamps. Runs on the worker's thread, up to 3 s, one
// measurement at a time; samples are not delayed.
class LoopBackRequestHandler {
 public:
  // `wire` exists if `lines` exist.
  LoopBackRequestHandler(std::optional<board::LoopBack> lines, std::unique_ptr<gpio::LoopBack> wire)
      : lines_{std::move(lines)}, wire_{std::move(wire)} {}

  // For the thread of the links. Returns false while a measurement waits or runs; otherwise answer() or end() must
  // follow.
  bool begin() { return !busy_.exchange(true); }
  void end() { busy_ = false; }

  // may: rights of the caller.
  Reply answer(std::span<const std::byte> body, const board::Access& may);

 private:
  Reply measured(std::span<const std::byte> body, const board::Access& may);

  std::atomic<bool> busy_{};
  std::optional<board::LoopBack> lines_;
  std::unique_ptr<gpio::LoopBack> wire_;
};

}  // namespace probebox::app
