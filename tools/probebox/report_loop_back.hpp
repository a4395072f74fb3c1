#pragma once
#include <cstdint>
#include <string>

#include "protocol/messages/control.hpp"
#include "tools/probebox/box.hpp"
#include "tools/probebox/console.hpp"

// How late the box stamps edges, by pulses of its own.
namespace probebox::command {

Json describe(const messages::LoopBack::Answer& late);
std::string page(const messages::LoopBack::Answer& late);

// Asks the box and says the answer, or why there is none. pulses: 0 for as many as is usual.
ExitStatus loopBack(link::Client& box, Console& console, std::uint32_t pulses = 0);

}  // namespace probebox::command
