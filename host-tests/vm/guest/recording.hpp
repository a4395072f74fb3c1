#pragma once
#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace probebox::vm {

// `probebox record` over USB, as the person at the PC.
class Recording {
 public:
  explicit Recording(int seconds);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  // Samples are coming, within twenty seconds.
  bool running() const;
  void signal(int number) const;
  void end(int signal);
  // Waits until its time is over: what the command said last, and its exit_status.
  nlohmann::json summary();

 private:
  pid_t pid_{};
};

}  // namespace probebox::vm
