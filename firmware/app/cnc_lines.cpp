#include "firmware/app/cnc_lines.hpp"

#include <pthread.h>
#include <string_view>

#include "firmware/app/log.hpp"

namespace probebox::app {

Outcome<ModbusOptions> CncLine::parse(const std::string& text) {
  constexpr std::string_view kModbus = "modbus:";
  if (!std::string_view{text}.starts_with(kModbus))
    return Error{"The CNC line '" + text + "' is not modbus:DEVICE[,baud=19200][,parity=even][,unit=1]."};
  return parseModbusOptions(std::string_view{text}.substr(kModbus.size()));
}

CncLine::CncLine(const ModbusOptions& options, StateBuffer& states, ControlDesk& desk, Counters& counters)
    : states_{states},
      desk_{desk},
      counters_{counters},
      device_{options.line.path},
      server_{options,
              {.snapshot = [this] { return snapshot(); },
               .take_marker = [this](const Marker& marker) { return takeMarker(marker); },
               .report = [](const std::string& text) { logWarning(text); }}} {}

CncLine::~CncLine() {
  server_.stop();
  if (thread_.joinable()) thread_.join();
}

void CncLine::start() {
  thread_ = std::thread{[this] { server_.run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc");
}

// Asked for before every answer, on the line's own thread: the time to tell all lines' counters as one.
corrections::Snapshot CncLine::snapshot() {
  const ModbusCounters now = server_.counters();
  counters_.modbus_requests += now.answered + now.refused - counted_.answered - counted_.refused;
  counters_.modbus_bad_frames += now.bad_frames - counted_.bad_frames;
  counted_ = now;
  return states_.newest().snapshot;
}

bool CncLine::takeMarker(const Marker& marker) {
  const auto error = desk_.postMarker(marker, states_.newest());
  if (error) logWarning("A marker from " + device_ + " was refused: " + error->what);
  return !error;
}

}  // namespace probebox::app
