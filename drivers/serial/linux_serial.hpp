#pragma once
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Names the type of a path that cannot be a serial line: a file, a folder, another device. Does not open it, which
// would raise the modem lines. nullopt for a missing device.
std::optional<Error> whyNoLine(const std::string& path);

// Opens a serial line raw, non-blocking and exclusively. Errors with remedies: missing, busy or forbidden device, not a
// serial line, unsupported speed. A hang-up is reported as `closed`.
Outcome<std::unique_ptr<io::BytePipe>> openSerial(const std::string& path, const Settings& settings);

}  // namespace probebox::serial
