#include "firmware/app/cnc/modbus_server.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <modbus/modbus.h>
#include <poll.h>
#include <thread>
#include <utility>
#include <vector>

namespace probebox::app {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr serial::Settings kUsual{19200, serial::Parity::even, 8, 1};
// Longer than the pauses of a USB adapter (16 ms), shorter than any master's time-out.
constexpr milliseconds kSilence{50};
constexpr milliseconds kIdle{1000};

// The silence that must stand before an answer: 3.5 characters of 11 bits, and never below 1.75 ms.
microseconds turnaround(unsigned baud) {
  return std::max(microseconds{1750}, microseconds{38'500'000 / baud});
}

}  // namespace

Outcome<ModbusOptions> parseModbusOptions(std::string_view text) {
  ModbusOptions options;
  std::string line;
  for (std::size_t at = 0; at <= text.size();) {
    const auto part = text.substr(at, text.find(',', at) - at);
    at += part.size() + 1;
    if (!part.starts_with("unit=")) {
      line += (line.empty() ? "" : ",") + std::string{part};
      continue;
    }
    const auto number = part.substr(5);
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), options.unit);
    if (error != std::errc{} || end != number.data() + number.size() || options.unit < 1 || options.unit > 247) {
      return Error{"'" + std::string{part} + "' is not a Modbus unit: write unit=1 to unit=247"};
    }
  }
  TRY(auto address, serial::parseAddress(line, kUsual));
  options.line = std::move(address);
  return options;
}

ModbusServer::ModbusServer(const ModbusOptions& options, Callbacks callbacks)
    : options_{options},
      round_{std::move(callbacks.round)},
      handler_{options.unit, options.revision, std::move(callbacks.registers)},
      line_{options.line, std::move(callbacks.report)} {}

void ModbusServer::run() {
  line_.run([this] { serveOnce(); });
}

void ModbusServer::serveOnce() {
  std::array<pollfd, 2> waits{pollfd{line_.pipe()->descriptor(), POLLIN, 0}, pollfd{line_.wakeUp(), POLLIN, 0}};
  const auto wait = [&](auto timeout) {
    const auto ms = std::chrono::ceil<milliseconds>(timeout);
    return poll(waits.data(), waits.size(), static_cast<int>(ms.count()));
  };
  int ready = 0;
  if (requests_.pending()) {
    ready = wait(turnaround(options_.line.settings.baud));
    const auto request = ready == 0 ? requests_.afterPause() : std::nullopt;
    if (request) answer(*request);
  }
  if (ready == 0) {
    ready = wait(requests_.pending() || echo_.awaiting() ? kSilence : kIdle);
    if (ready == 0) silence();
  }
  if (round_) round_();
  if (ready > 0 && waits[0].revents != 0) receive();
  bad_frames_ = requests_.badFrames();
  skipped_bytes_ = requests_.skippedBytes();
}

void ModbusServer::lost() {
  line_.lost();
  silence();
  handler_.restart();
}

void ModbusServer::receive() {
  std::array<std::byte, modbus::kMaxFrameBytes> buffer{};
  const auto got = line_.pipe()->read(buffer);
  if (got.bytes > 0) line_.heard();
  const auto now = std::chrono::steady_clock::now();
  // An echo may have waited for the box; while one is awaited, poll() finds the silence of the line.
  const bool was_silent = now - heard_at_ > kSilence && !echo_.awaiting();
  if (got.bytes > 0 && was_silent) silence();
  const auto [held, rest] = echo_.strip(std::span{buffer}.first(got.bytes));
  // Answering begins to wait for another echo, in the place of the one that `held` is of.
  const std::vector<std::byte> began{held.begin(), held.end()};
  serve(began);
  serve(rest);
  // The time that answers take is no silence of the line.
  if (got.bytes > 0) heard_at_ = std::chrono::steady_clock::now();
  if (got.state == io::PipeState::closed) lost();
}

void ModbusServer::serve(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    bytes = bytes.subspan(requests_.push(bytes));
    while (const auto request = requests_.next()) answer(*request);
  }
}

void ModbusServer::silence() {
  requests_.silence();
  echo_.silence();
}

void ModbusServer::answer(const modbus::Request& request) {
  if (request.unit() != options_.unit && request.unit() != MODBUS_BROADCAST_ADDRESS) return;
  std::this_thread::sleep_for(turnaround(options_.line.settings.baud));
  const auto [kind, frame] = handler_.answer(request);
  const bool sent = frame.empty() || line_.pipe()->write(std::as_bytes(frame)).bytes == frame.size();
  echo_.sent(frame);
  using Kind = RegisterHandler::Answer::Kind;
  ++(!sent || kind == Kind::failed ? unsent_ : kind == Kind::refused ? refused_ : answered_);
}

ModbusCounters ModbusServer::counters() const {
  return {answered_, refused_, bad_frames_, skipped_bytes_, unsent_, line_.reopened()};
}

}  // namespace probebox::app
