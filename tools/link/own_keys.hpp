#pragma once
#include "drivers/tls/context.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::link {

// Loads the keys of whoever runs this program, for boxes' tls: links: me.crt, me.key and boxes.crt (the CA of the
// boxes) of the folder PROBEBOX_TLS, else of probebox in $XDG_CONFIG_HOME or ~/.config. Error: the file that is missing
// or wrong, and where to get it.
Outcome<tls::Context> ownKeys();

}  // namespace probebox::link
