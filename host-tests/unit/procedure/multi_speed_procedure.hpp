#pragma once
#include <cstdint>
#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "obedient_machine.hpp"

namespace probebox::procedure {

// Runs of delay-multi-speed, and a machine that does what they ask for.
class MultiSpeedProcedure : public testing::Test {
 protected:
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};

  void start(std::uint32_t run) { procedure.start({.run = run, .method = kDelayMultiSpeed.number, .at = {}}); }
  void touchAll() {
    while (procedure.progress().state == State::waiting) machine.touch();
  }
};

}  // namespace probebox::procedure
