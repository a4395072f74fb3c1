#include "drivers/serial/transceiver.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <sys/ioctl.h>
#include <termios.h>
#include <thread>
#include <utility>

#include "drivers/io/descriptor.hpp"

namespace probebox::serial {
namespace {

using std::chrono::milliseconds;
using SteadyTime = std::chrono::steady_clock;

constexpr milliseconds kMostWaiting{1000};

class TurnedPipe final : public io::BytePipe {
 public:
  TurnedPipe(std::unique_ptr<io::BytePipe> line, std::unique_ptr<Transceiver> transceiver, const Settings& settings)
      : line_{std::move(line)},
        transceiver_{std::move(transceiver)},
        before_{settings.rs485.before_ms},
        after_{settings.rs485.after_ms},
        byte_{std::chrono::nanoseconds{1'000'000'000ULL * bitsPerCharacter(settings) / settings.baud}} {}

  io::Transfer read(std::span<std::byte> into) override { return line_->read(into); }
  io::Transfer write(std::span<const std::byte> from) override {
    if (from.empty()) return line_->write(from);
    if (!transceiver_->turn(true)) return {0, io::PipeState::closed};
    std::this_thread::sleep_for(before_);
    const auto begin = SteadyTime::now();
    auto sent = sendAll(from, begin);
    transceiver_->drain();
    // Drivers of adapters on USB do not know how much of it waits in the adapter, nor when it begins to leave: that
    // takes after_ of 2 ms or more (docs/integrator.md).
    std::this_thread::sleep_until(begin + sent.bytes * byte_);
    std::this_thread::sleep_for(after_);
    if (!transceiver_->turn(false)) sent.state = io::PipeState::closed;
    return sent;
  }
  int descriptor() const override { return line_->descriptor(); }
  std::string_view name() const override { return line_->name(); }

 private:
  io::Transfer sendAll(std::span<const std::byte> from, SteadyTime::time_point begin) {
    io::Transfer sent;
    while (sent.bytes < from.size() && sent.state == io::PipeState::open && SteadyTime::now() < begin + kMostWaiting) {
      const auto taken = line_->write(from.subspan(sent.bytes));
      sent = {sent.bytes + taken.bytes, taken.state};
      if (taken.bytes == 0) std::this_thread::sleep_for(milliseconds{1});
    }
    return sent;
  }

  std::unique_ptr<io::BytePipe> line_;
  std::unique_ptr<Transceiver> transceiver_;  // uses the line's descriptor
  milliseconds before_, after_;
  std::chrono::nanoseconds byte_;
};

class RtsTransceiver final : public Transceiver {
 public:
  RtsTransceiver(int line, bool active_high) : line_{line}, active_high_{active_high} {}
  bool turn(bool sending) override {
    int rts = TIOCM_RTS;
    return ioctl(line_, sending == active_high_ ? TIOCMBIS : TIOCMBIC, &rts) == 0;
  }
  void drain() override { tcdrain(line_); }

 private:
  int line_;
  bool active_high_;
};

class GpioTransceiver final : public Transceiver {
 public:
  GpioTransceiver(int line, io::Descriptor output) : line_{line}, output_{std::move(output)} {}
  bool turn(bool sending) override {
    gpio_v2_line_values values{.bits = sending ? 1U : 0U, .mask = 1};
    return ioctl(output_.get(), GPIO_V2_LINE_SET_VALUES_IOCTL, &values) == 0;
  }
  void drain() override { tcdrain(line_); }

 private:
  int line_;
  io::Descriptor output_;
};

struct GpioLine {
  io::Descriptor chip;
  unsigned offset{};
};

// The offset of a line by its name, or by "CHIP/OFFSET", where CHIP is the chip's name or label.
std::optional<unsigned> offsetOn(int chip, const std::string& wanted) {
  gpiochip_info info{};
  if (ioctl(chip, GPIO_GET_CHIPINFO_IOCTL, &info) != 0) return std::nullopt;
  if (const auto slash = wanted.rfind('/'); slash != std::string::npos) {
    const auto name = wanted.substr(0, slash);
    unsigned offset = 0;
    const auto* const end = wanted.data() + wanted.size();
    const auto [stop, error] = std::from_chars(wanted.data() + slash + 1, end, offset);
    if (error == std::errc{} && stop == end && offset < info.lines && (name == info.name || name == info.label))
      return offset;
  }
  for (unsigned offset = 0; offset < info.lines; ++offset) {
    gpio_v2_line_info line{};
    line.offset = offset;
    if (ioctl(chip, GPIO_V2_GET_LINEINFO_IOCTL, &line) == 0 && wanted == line.name) return offset;
  }
  return std::nullopt;
}

std::optional<GpioLine> findGpio(const std::string& wanted) {
  std::error_code none;
  for (const auto& node : std::filesystem::directory_iterator{"/dev", none}) {
    if (!node.path().filename().string().starts_with("gpiochip")) continue;
    io::Descriptor chip{::open(node.path().c_str(), O_RDWR | O_CLOEXEC)};
    if (!chip) continue;
    if (const auto offset = offsetOn(chip.get(), wanted)) return GpioLine{std::move(chip), *offset};
  }
  return std::nullopt;
}

Outcome<std::unique_ptr<Transceiver>> openGpio(int line, const Rs485& rs485) {
  const auto found = findGpio(rs485.gpio);
  if (!found)
    return Error{"no gpio chip that may be opened has a line '" + rs485.gpio +
                 "' (rs485=gpio): gpioinfo lists chips and lines, and the group gpio may open them"};
  auto request = gpioRequest(found->offset, rs485);
  if (ioctl(found->chip.get(), GPIO_V2_GET_LINE_IOCTL, &request) != 0)
    return Error{"the gpio line '" + rs485.gpio + "' (rs485=gpio) cannot be an output: " + std::strerror(errno) +
                 (errno == EBUSY ? "; gpioinfo says who uses it" : "")};
  return std::unique_ptr<Transceiver>{std::make_unique<GpioTransceiver>(line, io::Descriptor{request.fd})};
}

}  // namespace

std::unique_ptr<io::BytePipe> turnedPipe(std::unique_ptr<io::BytePipe> line, std::unique_ptr<Transceiver> transceiver,
                                         const Settings& settings) {
  return std::make_unique<TurnedPipe>(std::move(line), std::move(transceiver), settings);
}

serial_rs485 kernelRequest(const Rs485& rs485) {
  serial_rs485 request{};
  request.flags = SER_RS485_ENABLED | (rs485.active_high ? SER_RS485_RTS_ON_SEND : SER_RS485_RTS_AFTER_SEND);
  request.delay_rts_before_send = rs485.before_ms;
  request.delay_rts_after_send = rs485.after_ms;
  return request;
}

gpio_v2_line_request gpioRequest(unsigned offset, const Rs485& rs485) {
  gpio_v2_line_request request{};
  request.offsets[0] = offset;
  request.num_lines = 1;
  std::strncpy(request.consumer, "probebox rs485", sizeof(request.consumer) - 1);
  request.config.flags = GPIO_V2_LINE_FLAG_OUTPUT;
  if (!rs485.active_high) request.config.flags |= GPIO_V2_LINE_FLAG_ACTIVE_LOW;
  return request;  // the value of an output without one is 0
}

Outcome<void> turnByKernel(int line, const Rs485& rs485) {
  const auto wanted = kernelRequest(rs485);
  auto taken = wanted;
  if (ioctl(line, TIOCSRS485, &taken) != 0)
    return Error{
        "its driver cannot turn an RS-485 transceiver (rs485=kernel): write rs485=rts or rs485=gpio:LINE, or take "
        "an adapter that turns by itself and leave the setting out"};
  // Drivers change what they cannot do, and say so.
  constexpr auto kAsked = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND | SER_RS485_RTS_AFTER_SEND;
  if ((taken.flags & kAsked) != wanted.flags)
    return Error{
        "its driver does not turn an RS-485 transceiver with this level (rs485=kernel): write the other "
        "rs485_active, or rs485=rts"};
  if (taken.delay_rts_before_send != wanted.delay_rts_before_send ||
      taken.delay_rts_after_send != wanted.delay_rts_after_send)
    return Error{"its driver takes delays of " + std::to_string(taken.delay_rts_before_send) + " ms before and " +
                 std::to_string(taken.delay_rts_after_send) + " ms after (rs485=kernel): write these, or rs485=rts"};
  return {};
}

Outcome<std::unique_ptr<Transceiver>> openTransceiver(int line, const Rs485& rs485) {
  if (rs485.by == Turning::gpio) return openGpio(line, rs485);
  std::unique_ptr<Transceiver> transceiver = std::make_unique<RtsTransceiver>(line, rs485.active_high);
  if (!transceiver->turn(false))
    return Error{
        "it has no RTS that could turn an RS-485 transceiver (rs485=rts): write rs485=gpio:LINE, or take an adapter "
        "that turns by itself and leave the setting out"};
  return transceiver;
}

}  // namespace probebox::serial
