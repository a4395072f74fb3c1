#pragma once
#include <memory>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Opens a serial line raw, non-blocking and for this process alone. A missing, busy or forbidden device, one that is no
// serial line, and a speed that it does not have are errors, each with its remedy. A hang-up shows as `closed`.
Outcome<std::unique_ptr<io::BytePipe>> openSerial(const std::string& path, const Settings& settings);

}  // namespace probebox::serial
