#pragma once
#include <string>

#include "firmware/metrology/selftest/selftest.hpp"
#include "protocol/messages/self_test.hpp"
#include "tools/probebox/cli/console.hpp"

// How late the box stamps edges, by pulses of its own.
namespace probebox::command {

Json describe(const messages::LoopBack::Answer& late);
std::string line(const messages::LoopBack::Answer& late);

// On a busy box a pulse now and then finds no edge in time. From one in a hundred on it is the wire.
metrology::Finding judge(const messages::LoopBack::Answer& late);

}  // namespace probebox::command
