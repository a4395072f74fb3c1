#include "line_holder.hpp"

#include <gpiod.h>

namespace probebox::vm {
namespace {

gpiod_line_request* hold(const std::string& chip, unsigned line, const char* name) {
  auto* const settings = gpiod_line_settings_new();
  gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT);
  auto* const lines = gpiod_line_config_new();
  gpiod_line_config_add_line_settings(lines, &line, 1, settings);
  auto* const request = gpiod_request_config_new();
  gpiod_request_config_set_consumer(request, name);
  auto* const opened = gpiod_chip_open(("/dev/" + chip).c_str());
  auto* const held = opened == nullptr ? nullptr : gpiod_chip_request_lines(opened, request, lines);
  if (opened != nullptr) gpiod_chip_close(opened);
  gpiod_request_config_free(request);
  gpiod_line_config_free(lines);
  gpiod_line_settings_free(settings);
  return held;
}

}  // namespace

LineHolder::LineHolder(const std::string& chip, unsigned line, const char* name) : held_{hold(chip, line, name)} {}

LineHolder::~LineHolder() {
  if (held_ != nullptr) gpiod_line_request_release(held_);
}

}  // namespace probebox::vm
