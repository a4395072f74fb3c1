#pragma once
#include <string>
#include <thread>

#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/cnc/wishes.hpp"
#include "firmware/app/host/control_desk.hpp"
#include "firmware/app/host/link_service.hpp"
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

  struct Colleagues {
    ControlDesk& desk;
    LinkService& links;
    DoorBook& doors;
    ServedRecord& served;
    const Calibrations& calibrations;
    std::uint16_t boots{};
  };
  // may: what the controller may do.
  CncLine(const ModbusOptions& options, const board::Access& may, StateBuffer& states, const Colleagues& colleagues);
  ~CncLine();
  CncLine(const CncLine&) = delete;
  CncLine& operator=(const CncLine&) = delete;

  void start();
  // Any thread:
  const std::string& device() const { return device_; }
  ModbusCounters counters() const { return server_.counters(); }
  std::uint64_t rounds() const { return server_.rounds(); }

 private:
  bool take(std::span<const Event> said);
  bool keep(modbus::WordOrder order);
  const published::Snapshot& toBeServed();
  published::LineState lineState();

  board::Access may_;
  StateBuffer& states_;
  Colleagues with_;
  std::string device_;
  std::string door_;  // in the book
  TimeSource time_;
  LimitedWarning refused_{std::chrono::seconds{10}};  // a master may repeat a refused write at every cycle
  Wishes wishes_;
  modbus::RegisterImage::Results features_of_;  // results in force that features_ were found with
  published::KnownFeatures features_;
  ModbusServer server_;
  std::thread thread_;
};

}  // namespace probebox::app
