#include "firmware/app/cnc/modbus_server.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fcntl.h>
#include <modbus/modbus.h>
#include <new>
#include <poll.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "firmware/modbus/identification.hpp"

namespace probebox::app {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr serial::Settings kUsual{19200, serial::Parity::even, 8, 1};
// Longer than the pauses of a USB adapter (16 ms), shorter than any master's time-out.
constexpr milliseconds kSilence{50};
constexpr milliseconds kIdle{1000};
constexpr int kMostReads = MODBUS_MAX_READ_REGISTERS;
constexpr int kMostWrites = MODBUS_MAX_WRITE_REGISTERS;

// The silence that must stand before an answer: 3.5 characters of 11 bits, and never below 1.75 ms.
microseconds turnaround(unsigned baud) {
  return std::max(microseconds{1750}, microseconds{38'500'000 / baud});
}

}  // namespace

// libmodbus builds the answers; requests are found by length and CRC before it sees them. It writes into a pipe, so
// that the bytes of an answer are known when the line echoes them.
struct ModbusServer::Library {
  struct FreeContext {
    void operator()(modbus_t* context) const { modbus_free(context); }
  };
  struct FreeMapping {
    void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
  };

  explicit Library(const ModbusOptions& options)
      : context{modbus_new_rtu(options.line.path.c_str(), static_cast<int>(options.line.settings.baud), 'N', 8, 1)},
        mapping{modbus_mapping_new(0, 0, modbus::kRegisterCount, modbus::kRegisterCount)} {
    std::array<int, 2> ends{};
    if (!context || !mapping || pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC) != 0) throw std::bad_alloc{};
    out = io::Descriptor{ends[0]};
    in = io::Descriptor{ends[1]};
    modbus_set_slave(context.get(), options.unit);
    modbus_set_socket(context.get(), in.get());
  }

  // The answer that libmodbus has just written; empty for a broadcast, which nobody answers.
  std::span<const std::uint8_t> written() {
    const auto size = ::read(out.get(), answer.data(), answer.size());
    return std::span{answer}.first(size > 0 ? static_cast<std::size_t>(size) : 0);
  }

  io::Descriptor out;
  io::Descriptor in;
  std::array<std::uint8_t, modbus::kMaxFrameBytes> answer{};

  std::unique_ptr<modbus_t, FreeContext> context;
  std::unique_ptr<modbus_mapping_t, FreeMapping> mapping;
};

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

ModbusServer::ModbusServer(ModbusOptions options, Faces faces)
    : options_{std::move(options)},
      faces_{std::move(faces)},
      library_{std::make_unique<Library>(options_)},
      line_{options_.line, faces_.report} {}

ModbusServer::~ModbusServer() = default;

void ModbusServer::run() {
  line_.run([this] { serveOnce(); });
}

void ModbusServer::serveOnce() {
  std::array<pollfd, 2> waits{pollfd{line_.pipe()->descriptor(), POLLIN, 0}, pollfd{line_.wakeUp(), POLLIN, 0}};
  const auto timeout = requests_.pending() || echo_.awaiting() ? kSilence : kIdle;
  const int ready = poll(waits.data(), waits.size(), static_cast<int>(timeout.count()));
  if (ready == 0) silence();
  if (faces_.round) faces_.round();
  if (ready > 0 && waits[0].revents != 0) receive();
  bad_frames_ = requests_.badFrames();
  skipped_bytes_ = requests_.skippedBytes();
}

void ModbusServer::lost() {
  line_.lost();
  silence();
  writable_.restart();
}

void ModbusServer::receive() {
  std::array<std::byte, modbus::kMaxFrameBytes> buffer{};
  const auto got = line_.pipe()->read(buffer);
  if (got.bytes > 0) line_.heard();
  const auto now = std::chrono::steady_clock::now();
  if (got.bytes > 0 && now - std::exchange(heard_at_, now) > kSilence) silence();
  const auto [held, rest] = echo_.strip(std::span{buffer}.first(got.bytes));
  // Answering begins to wait for another echo, in the place of the one that `held` is of.
  const std::vector<std::byte> began{held.begin(), held.end()};
  serve(began);
  serve(rest);
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
  const Kept kept = faces_.kept();
  writable_.restore(kept.word_order, kept.inhibits);
  image_.fill(faces_.snapshot(), faces_.line ? faces_.line() : published::LineState{},
              faces_.results ? faces_.results() : nullptr, writable_.wordOrder());
  switch (request.function()) {
    case modbus::Function::read_holding:
    case modbus::Function::read_input:
      return read(request);
    case modbus::Function::write_one:
    case modbus::Function::write_many:
      return write(request);
    case modbus::Function::encapsulated:
      return identify(request);
  }
  refuse(request, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
}

void ModbusServer::read(const modbus::Request& request) {
  const int wanted = request.word(4);
  if (wanted < 1 || wanted > kMostReads) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  if (request.address() + static_cast<std::size_t>(wanted) > modbus::kRegisterCount) {
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  }
  reply(request);
}

void ModbusServer::write(const modbus::Request& request) {
  std::array<std::uint16_t, kMostWrites> values{};
  std::size_t wanted = 1;
  std::size_t data_at = 4;
  if (request.function() == modbus::Function::write_many) {
    wanted = request.word(4);
    data_at = 7;
    if (wanted < 1 || wanted > values.size() || request.bytes[6] != 2 * wanted) {
      return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
    }
  }
  for (std::size_t i = 0; i < wanted; ++i) values[i] = request.word(data_at + 2 * i);

  auto changed = writable_;
  const auto outcome = changed.write(request.address(), std::span{values}.first(wanted));
  if (!outcome) return refuse(request, static_cast<unsigned>(outcome.error().code));
  const auto order = writable_.wordOrder();
  if (changed.wordOrder() != order && !faces_.keep(changed.wordOrder()))
    return refuse(request, MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
  // What the box does not want leaves no trace, so that the same request may be tried again.
  if (!outcome->empty() && !faces_.take(*outcome)) {
    if (changed.wordOrder() != order) faces_.keep(order);
    return refuse(request, MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  }
  const bool wishes = changed.wish().commit != writable_.wish().commit;
  writable_ = changed;
  if (wishes && faces_.wish) faces_.wish(writable_.wish());
  reply(request);
}

void ModbusServer::identify(const modbus::Request& request) {
  std::array<std::uint8_t, modbus::kMaxFrameBytes> answer{};
  const auto size = modbus::identification(request, options_.revision, answer);
  if (size == 0) return refuse(request, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
  if (request.unit() != MODBUS_BROADCAST_ADDRESS) transmit(std::span{answer}.first(size), true, answered_);
}

void ModbusServer::reply(const modbus::Request& request) {
  writable_.show(image_.registers());
  auto* mapping = library_->mapping.get();
  const auto registers = image_.registers();
  std::copy(registers.begin(), registers.end(), mapping->tab_registers);
  std::copy(registers.begin(), registers.end(), mapping->tab_input_registers);
  send(modbus_reply(library_->context.get(), request.bytes.data(), static_cast<int>(request.size), mapping), answered_);
}

void ModbusServer::refuse(const modbus::Request& request, unsigned exception_code) {
  if (request.unit() == MODBUS_BROADCAST_ADDRESS) return;
  send(modbus_reply_exception(library_->context.get(), request.bytes.data(), exception_code), refused_);
}

// built: what libmodbus returned about an answer, negative when it made none.
void ModbusServer::send(int built, std::atomic<std::uint64_t>& counter) {
  transmit(library_->written(), built >= 0, counter);
}

void ModbusServer::transmit(std::span<const std::uint8_t> bytes, bool built, std::atomic<std::uint64_t>& counter) {
  const bool whole = built && (bytes.empty() || line_.pipe()->write(std::as_bytes(bytes)).bytes == bytes.size());
  echo_.sent(bytes);
  ++(whole ? counter : unsent_);
}

ModbusCounters ModbusServer::counters() const {
  return {answered_, refused_, bad_frames_, skipped_bytes_, unsent_, line_.reopened()};
}

}  // namespace probebox::app
