// Time from the last byte of a request to the last byte of its answer, registers 0 to 12, on a pseudo terminal that
// adds no time of its own: the box, which has to be silent for 3.5 characters (t3.5) first, and a bare libmodbus server
// that is not, asked in turns. `bench_modbus [requests] [baud]`; status 1 when the box takes longer than t3.5 and 1 ms
// (median) or 5 ms (99 %) beyond the bare one: what both take is the computer's.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <memory>
#include <modbus/modbus.h>
#include <optional>
#include <poll.h>
#include <string>
#include <termios.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "firmware/app/cnc/modbus_server.hpp"

namespace {

using namespace probebox;
using Clock = std::chrono::steady_clock;

constexpr std::array<std::uint8_t, 6> kAsked{1, 3, 0, 0, 0, 13};
constexpr std::size_t kAnswerBytes = 5 + 2 * 13;

// A pseudo terminal: `device` is opened by a server, as a serial line is.
struct Line {
  Line() : end{posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)} {
    if (!end || grantpt(end.get()) != 0 || unlockpt(end.get()) != 0) std::perror("pseudo terminal"), std::exit(2);
    device = ptsname(end.get());
    // Held open: a server that opens it later must not find what the terminal made of the first bytes.
    held = io::Descriptor{open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC)};
    termios raw{};
    tcgetattr(held.get(), &raw);
    cfmakeraw(&raw);
    tcsetattr(held.get(), TCSANOW, &raw);
  }
  io::Descriptor end, held;
  std::string device;
};

// ms; nothing without an answer within a second.
std::optional<double> ask(const Line& line) {
  std::array<std::uint8_t, kAsked.size() + 2> request{};
  std::copy(kAsked.begin(), kAsked.end(), request.begin());
  const auto crc = modbus::crc16(kAsked);
  request[6] = static_cast<std::uint8_t>(crc);
  request[7] = static_cast<std::uint8_t>(crc >> 8U);
  const auto asked = Clock::now();
  if (write(line.end.get(), request.data(), request.size()) != static_cast<ssize_t>(request.size()))
    return std::nullopt;
  std::size_t received = 0;
  while (received < kAnswerBytes) {
    pollfd waits{line.end.get(), POLLIN, 0};
    std::array<std::uint8_t, 256> buffer{};
    if (poll(&waits, 1, 1000) <= 0) return std::nullopt;
    const auto count = read(line.end.get(), buffer.data(), buffer.size());
    if (count <= 0) return std::nullopt;
    received += static_cast<std::size_t>(count);
  }
  return std::chrono::duration<double, std::milli>{Clock::now() - asked}.count();
}

// Receives and replies in a loop, as the examples of libmodbus do.
class BareServer {
 public:
  BareServer(const Line& line, unsigned baud)
      : context_{modbus_new_rtu(line.device.c_str(), static_cast<int>(baud), 'N', 8, 1)},
        registers_{modbus_mapping_new(0, 0, 122, 0)} {
    modbus_set_slave(context_, 1);
    if (modbus_connect(context_) != 0) std::perror("libmodbus"), std::exit(2);
    modbus_set_indication_timeout(context_, 0, 100'000);
    thread_ = std::thread{[this] {
      std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> request{};
      while (!stopped_) {
        const int size = modbus_receive(context_, request.data());
        if (size > 0) modbus_reply(context_, request.data(), size, registers_);
      }
    }};
  }
  ~BareServer() {
    stopped_ = true;
    thread_.join();
    modbus_mapping_free(registers_);
    modbus_close(context_);
    modbus_free(context_);
  }

 private:
  modbus_t* context_;
  modbus_mapping_t* registers_;
  std::atomic<bool> stopped_{};
  std::thread thread_;
};

struct Times {
  std::vector<double> ms;
  std::uint64_t unanswered{};

  void ask(const Line& line) {
    if (const auto took_ms = ::ask(line))
      ms.push_back(*took_ms);
    else
      ++unanswered;
  }
  double part(double share) {
    if (ms.empty()) return 1e9;
    std::ranges::sort(ms);
    return ms[static_cast<std::size_t>(share * static_cast<double>(ms.size() - 1))];
  }
};

}  // namespace

int main(int count, char** words) {
  const int requests = count > 1 ? std::atoi(words[1]) : 2000;
  const unsigned baud = count > 2 ? static_cast<unsigned>(std::atoi(words[2])) : 19200;
  const double silence_ms = std::max(1.75, 38'500.0 / baud);

  const Line box_line, bare_line;
  app::ModbusServer box{{.line = {box_line.device, {baud, serial::Parity::none, 8, 1}}},
                        {.registers = {.snapshot = [] { return published::Snapshot{}; },
                                       .take = [](std::span<const Event>) { return false; },
                                       .kept = [] { return app::RegisterHandler::Kept{}; }},
                         .report = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); }}};
  if (const auto opened = box.open(); !opened) {
    std::fprintf(stderr, "%s\n", opened.error().what.c_str());
    return 2;
  }
  std::thread serving{[&box] { box.run(); }};
  Times of_box, of_bare;
  {
    const BareServer bare{bare_line, baud};
    for (int k = 0; k < requests; ++k) {
      of_box.ask(box_line);
      of_bare.ask(bare_line);
    }
  }
  box.stop();
  serving.join();

  double load = 0;
  if (getloadavg(&load, 1) != 1) load = -1;
  const double median_ms = of_box.part(0.5), late_ms = of_box.part(0.99);
  const double bare_ms = of_bare.part(0.5), bare_late_ms = of_bare.part(0.99);
  const bool good =
      of_box.unanswered == 0 && median_ms - bare_ms <= silence_ms + 1 && late_ms - bare_late_ms <= silence_ms + 5;
  std::printf("%u baud, t3.5 = %.3f ms, %d requests each, load of the computer %.1f\n", baud, silence_ms, requests,
              load);
  std::printf("bare libmodbus: median %.3f ms, 99 %% %.3f ms, %llu unanswered\n", bare_ms, bare_late_ms,
              static_cast<unsigned long long>(of_bare.unanswered));
  std::printf("box:            median %.3f ms = t3.5 + %.3f, 99 %% %.3f ms = t3.5 + %.3f, %llu unanswered\n", median_ms,
              median_ms - silence_ms, late_ms, late_ms - silence_ms,
              static_cast<unsigned long long>(of_box.unanswered));
  std::printf("beyond t3.5, over bare libmodbus: median %.2f x, 99 %% %.2f x   (limits t3.5 + 1 ms and + 5 ms: %s)\n",
              (median_ms - silence_ms) / bare_ms, (late_ms - silence_ms) / bare_late_ms, good ? "ok" : "MISSED");
  return good ? 0 : 1;
}
