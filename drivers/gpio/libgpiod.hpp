#pragma once
#include <gpiod.h>
#include <memory>
#include <string>

#include "drivers/gpio/lines.hpp"
#include "protocol/units/outcome.hpp"

// Wraps chips and lines of libgpiod and adds remedies to its errors. Private to this room: no public header includes
// the library.
namespace probebox::gpio {

inline constexpr const char* kConsumer = "probeboxd";

template <auto free>
struct Free {
  void operator()(auto* object) const { free(object); }
};
using Chip = std::unique_ptr<gpiod_chip, Free<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Free<gpiod_chip_info_free>>;
using LineInfo = std::unique_ptr<gpiod_line_info, Free<gpiod_line_info_free>>;
using LineSettings = std::unique_ptr<gpiod_line_settings, Free<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Free<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Free<gpiod_request_config_free>>;
using LineRequest = std::unique_ptr<gpiod_line_request, Free<gpiod_line_request_release>>;
using EventBuffer = std::unique_ptr<gpiod_edge_event_buffer, Free<gpiod_edge_event_buffer_free>>;

// Explains why a chip cannot be used. code: an errno.
Error chipFailure(const std::string& chip, int code);
// Opens a chip by a path, a name such as gpiochip0, or a label.
Outcome<Chip> openChip(const std::string& wanted);
Outcome<unsigned> offsetOf(gpiod_chip& chip, const std::string& chip_name, const RequestedLine& line);
// Explains why the kernel refused a request, usually because another process holds a line. The offsets of `wanted` are
// known. not_possible and remedy: text for other errors.
Error requestFailure(gpiod_chip& chip, const ChipLines& wanted, int code, const std::string& not_possible,
                     const std::string& remedy);

// Adds an input whose edges the kernel stamps on CLOCK_MONOTONIC.
bool addInput(gpiod_line_config& config, const WatchedLine& line);

}  // namespace probebox::gpio
