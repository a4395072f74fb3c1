#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "protocol/messages/status.hpp"
#include "protocol/receiver/packet.hpp"

namespace probebox::usb_probe {

// What the samples and the loop-back edges of a receiver show of its inputs, window by window. Never allocates.
class InputFigures {
 public:
  void sample(std::uint8_t run, std::uint32_t counter, const Sample& sample);
  void loopBack(std::uint8_t run, std::uint32_t steps_a_sample, const LineEdge& edge);
  void restart();

  // Of the last whole window; all 0 before.
  const messages::ReceiverInputs& last() const { return last_; }
  // Whole windows so far.
  unsigned windows() const { return windows_; }

 private:
  void finish();

  messages::ReceiverInputs now_, last_;
  unsigned windows_{};
  std::uint8_t run_{};
  std::uint32_t next_{};                           // counter of the sample that follows without a gap
  std::uint32_t in_a_row_{};                       // samples without a gap, from 0
  std::array<std::array<double, 2>, 3> before_{};  // nm, the two samples before, of each channel
  std::array<double, 3> squares_{};                // of second differences
  std::uint32_t differences_{};
  std::optional<LineEdge> risen_;
};

}  // namespace probebox::usb_probe
