#include "drivers/gpio/libgpiod.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace probebox::gpio {

Error chipFailure(const std::string& chip, int code) {
  if (code == EACCES || code == EPERM) {
    return {chip +
            ": no permission; add your user to the group of the gpio devices (usually: sudo adduser $USER gpio)"};
  }
  if (code == ENOENT || code == ENODEV || code == ENXIO) {
    return {chip + ": there is no such gpio chip; gpiodetect lists names and labels, box.toml says which is used"};
  }
  return {chip + ": " + std::strerror(code) + "; box.toml must name a gpio chip"};
}

namespace {

bool labelled(gpiod_chip& chip, const std::string& label) {
  const ChipInfo info{gpiod_chip_get_info(&chip)};
  return info && label == gpiod_chip_info_get_label(info.get());
}

}  // namespace

Outcome<Chip> openChip(const std::string& wanted) {
  std::error_code error;
  const auto path = wanted.starts_with('/') ? wanted : "/dev/" + wanted;
  if (wanted.starts_with('/') || std::filesystem::exists(path, error)) {
    Chip chip{gpiod_chip_open(path.c_str())};
    if (!chip) return chipFailure(wanted, errno);
    return chip;
  }
  std::string closed_to_us;
  for (const auto& entry : std::filesystem::directory_iterator{"/dev", error}) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    Chip chip{gpiod_chip_open(entry.path().c_str())};
    if (!chip && errno == EACCES) closed_to_us = entry.path();
    if (chip && labelled(*chip, wanted)) return chip;
  }
  // It may be the one that cannot be asked for its label.
  if (!closed_to_us.empty()) return chipFailure(wanted + " (or is it " + closed_to_us + "?)", EACCES);
  return chipFailure(wanted, ENOENT);
}

Outcome<unsigned> offsetOf(gpiod_chip& chip, const std::string& chip_name, const RequestedLine& line) {
  const Error missing{chip_name + " has no " + lineText(line) +
                      "; gpioinfo lists its lines, box.toml says which are used"};
  if (const auto* const name = std::get_if<std::string>(&line.address)) {
    const int offset = gpiod_chip_get_line_offset_from_name(&chip, name->c_str());
    if (offset < 0) return missing;
    return static_cast<unsigned>(offset);
  }
  const ChipInfo info{gpiod_chip_get_info(&chip)};
  const auto offset = std::get<unsigned>(line.address);
  if (!info || offset >= gpiod_chip_info_get_num_lines(info.get())) return missing;
  return offset;
}

Error requestFailure(gpiod_chip& chip, const ChipLines& wanted, int code, const std::string& not_possible,
                     const std::string& remedy) {
  for (const auto& line : wanted.lines) {
    const LineInfo info{gpiod_chip_get_line_info(&chip, line.watched.offset)};
    if (!info || !gpiod_line_info_is_used(info.get())) continue;
    const char* const consumer = gpiod_line_info_get_consumer(info.get());
    return {wanted.chip + " " + lineText(line) + " is held by '" + (consumer != nullptr ? consumer : "the kernel") +
            "'; stop that, or give the box another line"};
  }
  return {wanted.chip + ": " + not_possible + ": " + std::strerror(code) + "; " + remedy};
}

namespace {

int edgeSetting(const WatchedLine& line) {
  if (line.edges == Edges::both) return GPIOD_LINE_EDGE_BOTH;
  return line.active == board::ActiveLevel::high ? GPIOD_LINE_EDGE_RISING : GPIOD_LINE_EDGE_FALLING;
}

}  // namespace

bool addInput(gpiod_line_config& config, const WatchedLine& line) {
  const LineSettings settings{gpiod_line_settings_new()};
  return settings && gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT) == 0 &&
         gpiod_line_settings_set_edge_detection(settings.get(), static_cast<gpiod_line_edge>(edgeSetting(line))) == 0 &&
         gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC) == 0 &&
         gpiod_line_config_add_line_settings(&config, &line.offset, 1, settings.get()) == 0;
}

}  // namespace probebox::gpio
