#pragma once
#include <string>
#include <sys/types.h>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::tour {

// Runs a program as a child process, which ends with this object.
class Process {
 public:
  // The program's output goes to `log`.
  static Outcome<Process> start(const std::vector<std::string>& command, const std::string& log);
  Process(Process&& other) noexcept;
  Process& operator=(Process&&) = delete;
  ~Process();

  pid_t pid() const { return pid_; }
  bool running();
  // Sends the signal and waits for the end.
  void kill(int signal);

 private:
  explicit Process(pid_t pid) : pid_{pid} {}
  pid_t pid_;
};

// Runs a program to its end and returns what it printed.
Outcome<std::string> outputOf(const std::vector<std::string>& command);

}  // namespace probebox::tour
