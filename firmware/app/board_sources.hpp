#pragma once
#include <memory>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/tcp/address.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// The drivers that a board's description asks for. Here, and nowhere else, concrete drivers are named. `box` is where
// the emulated machine's controller finds its box.
Outcome<std::vector<std::unique_ptr<io::EventSource>>> openSources(const board::Descriptions& descriptions,
                                                                   const tcp::Address& box, MonoTime now);

}  // namespace probebox::app
