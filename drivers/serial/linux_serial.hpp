#pragma once
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Says what a path is that can never be opened as a serial line: a file, a folder, another device. Looks and does not
// open, because opening would raise the modem lines of a real one. Nothing for a device that is not there yet.
std::optional<Error> whyNoLine(const std::string& path);

// Opens a serial line raw, non-blocking and for this process alone. A missing, busy or forbidden device, one that is no
// serial line, and a speed that it does not have are errors, each with its remedy. A hang-up shows as `closed`.
Outcome<std::unique_ptr<io::BytePipe>> openSerial(const std::string& path, const Settings& settings);

}  // namespace probebox::serial
