#pragma once
#include <string>

#include "firmware/metrology/selftest/selftest.hpp"
#include "protocol/messages/self_test.hpp"
#include "tools/probebox/cli/console.hpp"

// Reports how late the box stamps edges, measured with its own pulses.
namespace probebox::command {

Json describe(const messages::LoopBack::Answer& late);
std::string line(const messages::LoopBack::Answer& late);

// A busy box loses a pulse now and then; 1 % or more lost pulses mean a fault of the wire.
metrology::Finding judge(const messages::LoopBack::Answer& late);

}  // namespace probebox::command
