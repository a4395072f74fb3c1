#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "drivers/serial/settings.hpp"
#include "firmware/app/cnc/lasting_line.hpp"
#include "firmware/modbus/line_echo.hpp"
#include "firmware/modbus/register_image.hpp"
#include "firmware/modbus/rtu_requests.hpp"
#include "firmware/modbus/writable_registers.hpp"
#include "firmware/published/snapshot.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

struct ModbusOptions {
  serial::Address line;
  std::uint8_t unit{1};
  std::string revision{"unknown"};  // of the firmware, for device identification
};

// "DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,unit=1]"
Outcome<ModbusOptions> parseModbusOptions(std::string_view text);

struct ModbusCounters {
  std::uint64_t answered{};
  std::uint64_t refused{};     // answered by an exception
  std::uint64_t bad_frames{};  // runs of bytes that were not a request
  std::uint64_t skipped_bytes{};
  std::uint64_t unsent{};    // answers that the line did not accept
  std::uint64_t reopened{};  // times that the line was closed and opened again
};

// Serves the register map on one serial line in its own thread. A line that is closed is reopened, without limit.
class ModbusServer {
 public:
  // Choices of a master that survive a restart of the box and an unplugged adapter.
  struct Kept {
    modbus::WordOrder word_order{};
    bool inhibits{};
  };
  // All of these are called on the thread of run().
  struct Faces {
    std::function<published::Snapshot()> snapshot;     // for the next answer
    std::function<bool(std::span<const Event>)> take;  // events of a write, without stamps; false refuses all of them
    std::function<void(const std::string&)> report;    // the line was lost, or is back
    std::function<Kept()> kept;                        // choices in force for this line
    std::function<bool(modbus::WordOrder)> keep;       // stores a choice; true: it is on the disk
    std::function<void()> round{};  // called after every wait, at least once a second while the line is open
    std::function<published::LineState()> line{};               // further values of the next answer
    std::function<modbus::RegisterImage::Results()> results{};  // in force
    std::function<void(const modbus::Wish&)> wish{};            // a request about a run or a result was committed
  };

  ModbusServer(ModbusOptions options, Faces faces);
  ~ModbusServer();

  // Opens the line, to report a wrong device or setting at the start. run() opens it if this was not called.
  Outcome<void> open() { return line_.open(); }

  void run();
  void stop() { line_.stop(); }  // from any thread; run() returns at once

  ModbusCounters counters() const;
  // Increases while run() works, with or without traffic.
  std::uint64_t rounds() const { return line_.rounds(); }

 private:
  struct Library;

  void serveOnce();
  void receive();
  void lost();
  void serve(std::span<const std::byte> bytes);
  void silence();
  void answer(const modbus::Request& request);
  void read(const modbus::Request& request);
  void write(const modbus::Request& request);
  void reply(const modbus::Request& request);
  void refuse(const modbus::Request& request, unsigned exception_code);
  void identify(const modbus::Request& request);
  void transmit(std::span<const std::uint8_t> bytes, bool built, std::atomic<std::uint64_t>& counter);
  void send(int built, std::atomic<std::uint64_t>& counter);

  const ModbusOptions options_;
  const Faces faces_;
  std::unique_ptr<Library> library_;
  LastingLine line_;
  std::chrono::steady_clock::time_point heard_at_{};

  modbus::LineEcho echo_;
  modbus::RtuRequests requests_;
  modbus::RegisterImage image_;
  modbus::WritableRegisters writable_;

  std::atomic<std::uint64_t> answered_{};
  std::atomic<std::uint64_t> refused_{};
  std::atomic<std::uint64_t> unsent_{};
  std::atomic<std::uint64_t> bad_frames_{};
  std::atomic<std::uint64_t> skipped_bytes_{};
};

}  // namespace probebox::app
