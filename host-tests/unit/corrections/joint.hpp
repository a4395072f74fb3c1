#pragma once
#include <algorithm>
#include <gtest/gtest.h>

#include "machine_on_a_desk.hpp"

namespace probebox::corrections {

// An emulated joint under a controller that takes corrections as a careful one does: while they are valid and the
// heartbeat goes on it follows them, else it keeps what it has. It must never be asked to jump.
class Joint : public testing::Test {
 protected:
  explicit Joint(const CorrectionsConfig& config = MachineOnADesk::usual()) : machine{config} {}

  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * 100); ++i) {
      machine.run(0.01);
      const auto& served = machine.snapshot();
      const bool beats = served.heartbeat != heartbeat_;
      if (beats) heartbeat_ = served.heartbeat, beat_at_ = machine.now;
      if (!served.valid || machine.now - beat_at_ > milliseconds{300}) continue;
      for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
        const double step = std::abs(served.correction_mm[axis] - joint_mm[axis]);
        if (followed_) largest_step_mm = std::max(largest_step_mm, step);
        joint_mm[axis] = served.correction_mm[axis];
      }
      followed_ = true;
    }
  }
  // As after a fresh start with everything as it should be.
  void start() {
    run(0.3);
    machine.home();
    run(0.5);
  }

  MachineOnADesk machine;
  Vector joint_mm{};
  double largest_step_mm{};

 private:
  std::uint16_t heartbeat_{};
  MonoTime beat_at_{};
  bool followed_{};
};

inline constexpr double kStep_mm = 0.05 * 0.01 + 2e-6;  // the limit of rate over one reading

}  // namespace probebox::corrections
