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

CncLine::CncLine(const ModbusOptions& options, const board::Access& may, StateBuffer& states, ControlDesk& desk,
                 DoorBook& doors, ServedRecord& served)
    : may_{may},
      states_{states},
      desk_{desk},
      doors_{doors},
      served_{served},
      device_{options.line.path},
      door_{"modbus:" + device_},
      server_{options,
              {.snapshot = [this] { return toBeServed(); },
               .take = [this](const Event& event) { return take(event); },
               .report = [](const std::string& text) { logWarning(text); },
               .kept =
                   [this] {
                     return ModbusServer::Kept{static_cast<modbus::WordOrder>(doors_.wordOrder(door_)),
                                               doors_.inhibits(door_)};
                   },
               .keep = [this](modbus::WordOrder order) { return keep(order); },
               .round = [this] { refused_.look(time_.now()); }}} {}

CncLine::~CncLine() {
  server_.stop();
  if (thread_.joinable()) thread_.join();
}

void CncLine::start() {
  thread_ = std::thread{[this] { server_.run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc");
}

// Written down before the answer that has it goes out.
const published::Snapshot& CncLine::toBeServed() {
  const auto& snapshot = states_.newest().snapshot;
  served_.note(snapshot);
  return snapshot;
}

bool CncLine::take(const Event& event) {
  const auto* cut = std::get_if<CutInhibit>(&event);
  const auto error =
      cut != nullptr ? desk_.setInhibit(door_, cut->active, may_) : desk_.post(event, states_.newest(), may_);
  if (error) refused_.warn(time_.now(), "What " + device_ + " wrote was refused: " + error->what);
  return !error;
}

bool CncLine::keep(modbus::WordOrder order) {
  const auto error = doors_.keepWordOrder(door_, static_cast<std::uint16_t>(order));
  if (error) logWarning("The word order of " + device_ + " was refused: " + error->what);
  return !error;
}

}  // namespace probebox::app
