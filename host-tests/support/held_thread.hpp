#pragma once
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <utility>

#include "protocol/units/outcome.hpp"

namespace probebox::support {

// Stops one thread of another process by ptrace while this object lives; the other threads run on.
class HeldThread {
 public:
  // thread: its name (/proc/PID/task/*/comm).
  static Outcome<HeldThread> hold(pid_t process, const std::string& thread) {
    for (const auto& task : std::filesystem::directory_iterator{"/proc/" + std::to_string(process) + "/task"}) {
      std::string name;
      std::getline(std::ifstream{task.path() / "comm"}, name);
      if (name != thread) continue;
      const pid_t id = std::stoi(task.path().filename());
      if (ptrace(PTRACE_SEIZE, id, nullptr, nullptr) != 0 || ptrace(PTRACE_INTERRUPT, id, nullptr, nullptr) != 0 ||
          waitpid(id, nullptr, __WALL) != id)
        return Error{std::string{"ptrace: "} + std::strerror(errno)};
      return HeldThread{id};
    }
    return Error{"no thread " + thread};
  }
  HeldThread(HeldThread&& other) noexcept : id_{std::exchange(other.id_, 0)} {}
  HeldThread& operator=(HeldThread&&) = delete;
  ~HeldThread() {
    if (id_ != 0) ptrace(PTRACE_DETACH, id_, nullptr, nullptr);
  }

 private:
  explicit HeldThread(pid_t id) : id_{id} {}
  pid_t id_;
};

}  // namespace probebox::support
