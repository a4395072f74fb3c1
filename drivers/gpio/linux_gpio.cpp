#include "drivers/gpio/linux_gpio.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <gpiod.h>
#include <utility>

namespace probebox::gpio {
namespace {

constexpr std::size_t kKernelBufferEdges = 1024;  // the most that the kernel gives
constexpr std::size_t kReadEdges = 64;            // at once
constexpr const char* kConsumer = "probeboxd";

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

std::string lineText(const RequestedLine& line) {
  const auto* const offset = std::get_if<unsigned>(&line.address);
  const auto address = offset != nullptr ? std::to_string(*offset) : "\"" + std::get<std::string>(line.address) + "\"";
  return "line " + address + " (" + line.name + ")";
}

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

bool labelled(gpiod_chip& chip, const std::string& label) {
  const ChipInfo info{gpiod_chip_get_info(&chip)};
  return info && label == gpiod_chip_info_get_label(info.get());
}

// By a path, a name such as gpiochip0, or a label.
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

// Why the kernel refused a request: most often a line that somebody else holds.
Error requestFailure(gpiod_chip& chip, const ChipLines& wanted, int code) {
  for (const auto& line : wanted.lines) {
    const LineInfo info{gpiod_chip_get_line_info(&chip, line.watched.offset)};
    if (!info || !gpiod_line_info_is_used(info.get())) continue;
    const char* const consumer = gpiod_line_info_get_consumer(info.get());
    return {wanted.chip + " " + lineText(line) + " is held by '" + (consumer != nullptr ? consumer : "the kernel") +
            "'; stop that, or give the box another line"};
  }
  return {wanted.chip + ": the lines cannot be watched for edges: " + std::strerror(code) +
          "; choose lines that can give interrupts"};
}

int edgeSetting(const WatchedLine& line) {
  if (line.edges == Edges::both) return GPIOD_LINE_EDGE_BOTH;
  return line.active == board::ActiveLevel::high ? GPIOD_LINE_EDGE_RISING : GPIOD_LINE_EDGE_FALLING;
}

bool addLine(gpiod_line_config& config, const WatchedLine& line) {
  const LineSettings settings{gpiod_line_settings_new()};
  return settings && gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT) == 0 &&
         gpiod_line_settings_set_edge_detection(settings.get(), static_cast<gpiod_line_edge>(edgeSetting(line))) == 0 &&
         gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC) == 0 &&
         gpiod_line_config_add_line_settings(&config, &line.offset, 1, settings.get()) == 0;
}

RawEdge rawEdge(gpiod_edge_event& event) {
  return {gpiod_edge_event_get_line_offset(&event),
          gpiod_edge_event_get_event_type(&event) == GPIOD_EDGE_EVENT_RISING_EDGE,
          static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(&event)),
          static_cast<std::uint32_t>(gpiod_edge_event_get_line_seqno(&event))};
}

}  // namespace

struct LinuxGpio::Request {
  Chip chip;
  LineRequest lines;
  EventBuffer buffer{gpiod_edge_event_buffer_new(kReadEdges)};
};

LinuxGpio::LinuxGpio(ChipLines chip) : chip_{std::move(chip)}, name_{chip_.chip} {
  for (const auto& line : chip_.lines) {
    name_ += (&line == chip_.lines.data() ? " " : ", ") + lineText(line);
    loss_.add(sourceOf(line.watched.role));
  }
  loss_.settle();
}

LinuxGpio::~LinuxGpio() = default;

Outcome<bool> LinuxGpio::acquire() {
  request_.reset();
  found_.clear();
  found_told_ = 0;
  lost_ = true;
  auto request = std::make_unique<Request>();
  auto chip = openChip(chip_.chip);
  if (!chip) return chip.error();
  request->chip = std::move(*chip);

  const LineConfig lines{gpiod_line_config_new()};
  const RequestConfig config{gpiod_request_config_new()};
  if (!lines || !config || !request->buffer) return Error{chip_.chip + ": out of memory"};
  std::vector<WatchedLine> watched;
  for (auto& line : chip_.lines) {
    const auto offset = offsetOf(*request->chip, chip_.chip, line);
    if (!offset) return offset.error();
    line.watched.offset = *offset;
    watched.push_back(line.watched);
    if (!addLine(*lines, line.watched)) return Error{chip_.chip + " " + lineText(line) + ": " + std::strerror(errno)};
  }
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  gpiod_request_config_set_event_buffer_size(config.get(), kKernelBufferEdges);
  request->lines.reset(gpiod_chip_request_lines(request->chip.get(), config.get(), lines.get()));
  if (!request->lines) return requestFailure(*request->chip, chip_, errno);

  // libgpiod waits for the first edge unless the descriptor says otherwise.
  const int fd = gpiod_line_request_get_fd(request->lines.get());
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  if (decoder_) {
    decoder_->restart(watched);
  } else {
    decoder_ = std::make_unique<EdgeDecoder>(std::move(watched));
  }
  if (!findLevels(*request)) return chipFailure(chip_.chip, errno);
  request_ = std::move(request);
  lost_ = false;
  return true;
}

bool LinuxGpio::findLevels(Request& request) {
  std::vector<unsigned> offsets;
  for (const auto& line : chip_.lines) {
    if (line.watched.edges == Edges::both) offsets.push_back(line.watched.offset);
  }
  std::vector<gpiod_line_value> values(offsets.size());
  if (!offsets.empty() &&
      gpiod_line_request_get_values_subset(request.lines.get(), offsets.size(), offsets.data(), values.data()) != 0) {
    return false;
  }
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    if (const auto edge = decoder_->found(offsets[i], values[i] == GPIOD_LINE_VALUE_ACTIVE)) found_.push_back(*edge);
  }
  return true;
}

int LinuxGpio::descriptor() const {
  return request_ ? gpiod_line_request_get_fd(request_->lines.get()) : -1;
}

std::size_t LinuxGpio::read(std::span<Event> into, MonoTime now) {
  std::size_t count = loss_.read(into, now);  // what an earlier call had no room for
  const auto levels = into.subspan(count, readLevels(into.subspan(count), now));
  count += levels.size();
  const auto edges = into.subspan(count, readEdges(into.subspan(count)));
  count += edges.size();
  // Edges that came since the lines were requested are older than `now`, the levels found at the request older still.
  if (!edges.empty()) {
    for (auto& level : levels) std::get<Edge>(level).at = std::min(now, stampOf(edges.front()));
  }
  return count + loss_.read(into.subspan(count), now);
}

std::size_t LinuxGpio::readLevels(std::span<Event> into, MonoTime now) {
  std::size_t count = 0;
  while (count < into.size() && found_told_ < found_.size()) {
    auto level = found_[found_told_++];
    level.at = now;
    into[count++] = level;
  }
  return count;
}

std::size_t LinuxGpio::readEdges(std::span<Event> into) {
  std::size_t count = 0;
  while (!lost_ && count < into.size()) {
    const int got = gpiod_line_request_read_edge_events(request_->lines.get(), request_->buffer.get(),
                                                        std::min(into.size() - count, kReadEdges));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno != EAGAIN) {
      lost_ = true;
      loss_.raise();
      request_.reset();  // its descriptor would look readable for ever
      break;
    }
    if (got <= 0) break;
    for (unsigned long i = 0; i < static_cast<unsigned long>(got); ++i) {
      const auto edge = decoder_->decode(rawEdge(*gpiod_edge_event_buffer_get_event(request_->buffer.get(), i)));
      if (edge) into[count++] = *edge;
    }
  }
  return count;
}

}  // namespace probebox::gpio
