#pragma once
#include <string>
#include <thread>

#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/host/control_desk.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/results/door_book.hpp"
#include "firmware/app/results/served_record.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "firmware/app/threads/time_source.hpp"

namespace probebox::app {

// Serves one serial line of a CNC in its own thread, so lines do not delay each other.
class CncLine {
 public:
  // `text`: "modbus:DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,unit=1]".
  static Outcome<ModbusOptions> parse(const std::string& text);

  // may: what the controller may do.
  CncLine(const ModbusOptions& options, const board::Access& may, StateBuffer& states, ControlDesk& desk,
          DoorBook& doors, ServedRecord& served);
  ~CncLine();
  CncLine(const CncLine&) = delete;
  CncLine& operator=(const CncLine&) = delete;

  void start();
  // Any thread:
  const std::string& device() const { return device_; }
  ModbusCounters counters() const { return server_.counters(); }
  std::uint64_t rounds() const { return server_.rounds(); }

 private:
  bool take(const Event& event);
  bool keep(modbus::WordOrder order);
  const published::Snapshot& toBeServed();

  board::Access may_;
  StateBuffer& states_;
  ControlDesk& desk_;
  DoorBook& doors_;
  ServedRecord& served_;
  std::string device_;
  std::string door_;  // in the book
  TimeSource time_;
  LimitedWarning refused_{std::chrono::seconds{10}};  // a master may repeat a refused write at every cycle
  ModbusServer server_;
  std::thread thread_;
};

}  // namespace probebox::app
