#include "drivers/gpio/linux_gpio.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <utility>

#include "drivers/gpio/libgpiod.hpp"

namespace probebox::gpio {
namespace {

constexpr std::size_t kKernelBufferEdges = 1024;  // the most that the kernel gives
constexpr std::size_t kReadEdges = 64;            // at once

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

Outcome<void> LinuxGpio::acquire() {
  request_.reset();
  found_.clear();
  found_told_ = 0;
  lost_ = true;
  auto request = std::make_unique<Request>();
  TRY(auto chip, openChip(chip_.chip));
  request->chip = std::move(chip);

  const LineConfig lines{gpiod_line_config_new()};
  const RequestConfig config{gpiod_request_config_new()};
  if (!lines || !config || !request->buffer) return Error{chip_.chip + ": out of memory"};
  std::vector<WatchedLine> watched;
  for (auto& line : chip_.lines) {
    TRY(const auto offset, offsetOf(*request->chip, chip_.chip, line));
    line.watched.offset = offset;
    watched.push_back(line.watched);
    if (!addInput(*lines, line.watched)) return Error{chip_.chip + " " + lineText(line) + ": " + std::strerror(errno)};
  }
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  gpiod_request_config_set_event_buffer_size(config.get(), kKernelBufferEdges);
  request->lines.reset(gpiod_chip_request_lines(request->chip.get(), config.get(), lines.get()));
  if (!request->lines) {
    return requestFailure(*request->chip, chip_, errno, "the lines cannot be watched for edges",
                          "choose lines that can give interrupts");
  }

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
  return {};
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
