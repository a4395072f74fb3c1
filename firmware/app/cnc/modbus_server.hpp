#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/serial/settings.hpp"
#include "firmware/app/cnc/lasting_line.hpp"
#include "firmware/app/cnc/register_server.hpp"
#include "firmware/modbus/line_echo.hpp"
#include "firmware/modbus/rtu_requests.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

struct ModbusOptions {
  serial::Address line;
  std::uint8_t unit{1};
  std::string revision{"unknown"};  // of the firmware, for device identification
};

// "DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,unit=1]"
Outcome<ModbusOptions> parseModbusOptions(std::string_view text);

// Serves the register map on one serial line in its own thread. A line that is closed is reopened, without limit.
class ModbusServer final : public RegisterServer {
 public:
  ModbusServer(const ModbusOptions& options, Callbacks callbacks);

  // Opens the line, to report a wrong device or setting at the start. run() opens it if this was not called.
  Outcome<void> open() { return line_.open(); }

  void run() override;
  void stop() override { line_.stop(); }
  ModbusCounters counters() const override;
  std::uint64_t rounds() const override { return line_.rounds(); }

 private:
  void serveOnce();
  void receive();
  void lost();
  void serve(std::span<const std::byte> bytes);
  void silence();
  void answer(const modbus::Request& request);

  const ModbusOptions options_;
  const std::function<void()> round_;
  RegisterHandler handler_;
  LastingLine line_;
  std::chrono::steady_clock::time_point heard_at_{};

  modbus::LineEcho echo_;
  modbus::RtuRequests requests_;

  std::atomic<std::uint64_t> answered_{};
  std::atomic<std::uint64_t> refused_{};
  std::atomic<std::uint64_t> unsent_{};
  std::atomic<std::uint64_t> bad_frames_{};
  std::atomic<std::uint64_t> skipped_bytes_{};
};

}  // namespace probebox::app
