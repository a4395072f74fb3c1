#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "firmware/app/cnc/register_handler.hpp"

namespace probebox::app {

struct ModbusCounters {
  std::uint64_t answered{};
  std::uint64_t refused{};     // answered by an exception
  std::uint64_t bad_frames{};  // runs of bytes that were not a request
  std::uint64_t skipped_bytes{};
  std::uint64_t unsent{};    // answers that the line did not accept
  std::uint64_t reopened{};  // times that the line was closed and opened again
};

// Serves the register map to Modbus masters in a thread of its own.
class RegisterServer {
 public:
  // All are called on the thread of run().
  struct Callbacks {
    RegisterHandler::Callbacks registers;
    std::function<void(const std::string&)> report;  // for a person: a line or a master came or went as it should not
    std::function<void()> round{};                   // called at least once a second while the line is open
  };

  RegisterServer() = default;
  virtual ~RegisterServer() = default;
  RegisterServer(const RegisterServer&) = delete;
  RegisterServer& operator=(const RegisterServer&) = delete;

  virtual void run() = 0;
  virtual void stop() = 0;  // from any thread; run() returns at once

  // Any thread:
  virtual ModbusCounters counters() const = 0;
  // Increases while run() works, with or without traffic.
  virtual std::uint64_t rounds() const = 0;
};

}  // namespace probebox::app
