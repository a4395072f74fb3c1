#include "firmware/app/cnc/cnc_lines.hpp"

#include <pthread.h>
#include <string_view>

#include "firmware/app/log/log.hpp"

namespace probebox::app {

Outcome<ModbusOptions> CncLine::parse(const std::string& text) {
  constexpr std::string_view kModbus = "modbus:";
  if (!std::string_view{text}.starts_with(kModbus))
    return Error{"The CNC line '" + text + "' is not modbus:DEVICE[,baud=19200][,parity=even][,unit=1]."};
  return parseModbusOptions(std::string_view{text}.substr(kModbus.size()));
}

CncLine::CncLine(const ModbusOptions& options, StateBuffer& states, ControlDesk& desk)
    : states_{states},
      desk_{desk},
      device_{options.line.path},
      server_{options,
              {.snapshot = [this] { return states_.newest().snapshot; },
               .take = [this](const Event& event) { return take(event); },
               .report = [](const std::string& text) { logWarning(text); },
               .round = [this] { refused_.look(time_.now()); }}} {}

CncLine::~CncLine() {
  server_.stop();
  if (thread_.joinable()) thread_.join();
}

void CncLine::start() {
  thread_ = std::thread{[this] { server_.run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc");
}

bool CncLine::take(const Event& event) {
  const auto error = desk_.post(event, states_.newest());
  if (error) refused_.warn(time_.now(), "What " + device_ + " wrote was refused: " + error->what);
  return !error;
}

}  // namespace probebox::app
