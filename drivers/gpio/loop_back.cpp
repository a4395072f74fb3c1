#include "drivers/gpio/loop_back.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <thread>
#include <time.h>
#include <utility>

#include "drivers/gpio/libgpiod.hpp"

namespace probebox::gpio {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kTimeout = 10ms;  // for one edge: a thousand times what is usual
constexpr Nanoseconds kRest = 500us;    // between pulses, so that the input rests too
constexpr Nanoseconds kLongest = 3s;
constexpr int kHopeless = 25;  // lost one after the other: nothing will come
constexpr std::size_t kEchoesAtOnce = 16;

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(time.tv_sec * 1'000'000'000 + time.tv_nsec);
}

// A line and the chip that it is of.
struct HeldLine {
  Chip chip;
  LineRequest request;
  unsigned offset{};
};

// Where a line really is.
struct Place {
  std::string chip;
  unsigned offset{};
  bool operator==(const Place&) const = default;
};

// Nothing for a line that is not there now.
std::optional<Place> placeOf(const std::string& chip_name, const RequestedLine& line) {
  const auto chip = openChip(chip_name);
  if (!chip) return std::nullopt;
  const auto offset = offsetOf(**chip, chip_name, line);
  const ChipInfo info{gpiod_chip_get_info(chip->get())};
  if (!offset || !info) return std::nullopt;
  return Place{gpiod_chip_info_get_name(info.get()), *offset};
}

std::optional<Place> placeOf(const board::GpioLine& line) {
  return placeOf(line.chip, {line.name, line.line, {}});
}

bool addOutput(gpiod_line_config& config, unsigned offset, board::ActiveLevel active) {
  const LineSettings settings{gpiod_line_settings_new()};
  if (!settings) return false;
  gpiod_line_settings_set_active_low(settings.get(), active == board::ActiveLevel::low);
  return gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT) == 0 &&
         gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE) == 0 &&
         gpiod_line_config_add_line_settings(&config, &offset, 1, settings.get()) == 0;
}

Outcome<HeldLine> hold(const board::GpioLine& line, bool output) {
  HeldLine held;
  TRY(auto chip, openChip(line.chip));
  held.chip = std::move(chip);
  ChipLines wanted{line.chip, {{line.name, line.line, {.active = line.active, .edges = Edges::active}}}};
  TRY(const auto offset, offsetOf(*held.chip, line.chip, wanted.lines.front()));
  held.offset = wanted.lines.front().watched.offset = offset;

  const LineConfig lines{gpiod_line_config_new()};
  const RequestConfig config{gpiod_request_config_new()};
  const bool added = lines && config &&
                     (output ? addOutput(*lines, offset, line.active) : addInput(*lines, wanted.lines.front().watched));
  if (!added) return Error{describe(line) + ": " + std::strerror(errno)};
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  held.request.reset(gpiod_chip_request_lines(held.chip.get(), config.get(), lines.get()));
  if (held.request) return held;
  const int code = errno;
  return output
             ? requestFailure(*held.chip, wanted, code, lineText(wanted.lines.front()) + " cannot be driven",
                              "choose one that can be an output")
             : requestFailure(*held.chip, wanted, code, lineText(wanted.lines.front()) + " cannot be watched for edges",
                              "choose one that can give interrupts");
}

// Both lines, as long as this lives.
class Wire {
 public:
  Wire(HeldLine output, HeldLine input) : output_{std::move(output)}, input_{std::move(input)} {
    const int fd = gpiod_line_request_get_fd(input_.request.get());
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  }

  // Nothing when a line is gone.
  std::optional<LoopBackPulse> pulse() {
    if (!drain()) return std::nullopt;
    LoopBackPulse pulse{.before = now(), .after = {}, .stamp = {}};
    if (!write(GPIOD_LINE_VALUE_ACTIVE)) return std::nullopt;
    pulse.after = now();
    while (!pulse.stamp) {
      const Nanoseconds left = pulse.after + kTimeout - now();
      if (left <= Nanoseconds{0}) break;
      const int ready = gpiod_line_request_wait_edge_events(input_.request.get(), left.count());
      if (ready < 0 && errno != EINTR) return std::nullopt;
      if (ready > 0 && !read(pulse)) return std::nullopt;
    }
    if (!write(GPIOD_LINE_VALUE_INACTIVE)) return std::nullopt;
    return pulse;
  }

 private:
  bool write(gpiod_line_value value) {
    return gpiod_line_request_set_value(output_.request.get(), output_.offset, value) == 0;
  }
  // Discards edges that came too late for their own pulse, so that they are not taken for answers to the next one.
  bool drain() {
    LoopBackPulse nobody{.before = MonoTime::max(), .after = {}, .stamp = {}};
    return read(nobody);
  }
  // The first edge that is no older than the write.
  bool read(LoopBackPulse& pulse) {
    while (true) {
      const int got = gpiod_line_request_read_edge_events(input_.request.get(), buffer_.get(), kEchoesAtOnce);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return errno == EAGAIN;
      if (got == 0) return false;  // the chip has gone
      for (unsigned long i = 0; i < static_cast<unsigned long>(got); ++i) {
        auto* const event = gpiod_edge_event_buffer_get_event(buffer_.get(), i);
        const auto at = monoTime(static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event)));
        if (!pulse.stamp && at >= pulse.before) pulse.stamp = at;
      }
    }
  }

  HeldLine output_;
  HeldLine input_;
  EventBuffer buffer_{gpiod_edge_event_buffer_new(kEchoesAtOnce)};
};

}  // namespace

std::optional<Error> LinuxLoopBack::whyShared() const {
  const auto shared = [](const board::GpioLine& line, const std::string& with) {
    return Error{describe(line) + " is the line of '" + with + "': give each a line of its own in box.toml"};
  };
  const auto output = placeOf(lines_.output), input = placeOf(lines_.input);
  if (output && output == input) return shared(lines_.output, lines_.input.name);
  for (const auto& chip : watched_) {
    for (const auto& line : chip.lines) {
      const auto place = placeOf(chip.chip, line);
      if (place && place == output) return shared(lines_.output, line.name);
      if (place && place == input) return shared(lines_.input, line.name);
    }
  }
  return std::nullopt;
}

Outcome<std::vector<LoopBackPulse>> LinuxLoopBack::measure(std::size_t pulses) {
  if (auto error = whyShared()) return std::move(*error);
  TRY(auto output, hold(lines_.output, true));
  TRY(auto input, hold(lines_.input, false));
  Wire wire{std::move(output), std::move(input)};
  std::vector<LoopBackPulse> all;
  const MonoTime begun = now();
  int lost = 0;
  while (all.size() < pulses && lost < kHopeless && now() - begun < kLongest) {
    std::this_thread::sleep_for(kRest);
    const auto pulse = wire.pulse();
    if (!pulse) {
      return Error{"A line of the loop-back, " + describe(lines_.output) + " or " + describe(lines_.input) +
                   ", went away while it was measured: plug its chip in and measure again"};
    }
    lost = pulse->stamp ? 0 : lost + 1;
    all.push_back(*pulse);
  }
  return all;
}

}  // namespace probebox::gpio
