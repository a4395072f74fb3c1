#pragma once
#include <chrono>
#include <filesystem>
#include <optional>
#include <string_view>
#include <sys/types.h>

#include "drivers/io/descriptor.hpp"
#include "firmware/app/solver/solver_child.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/solve.hpp"

namespace probebox::app {

// Solves one case at a time in a child process without locks, memory or rights of the daemon: a case that exceeds the
// limits or crashes the child is refused, and the daemon continues. One thread.
class SolverProcess {
 public:
  // program: the probeboxd to run with `--solver`. Empty: start() solves at once in the calling thread, for programs
  // that embed parts of the daemon.
  explicit SolverProcess(std::filesystem::path program, SolverLimits limits = {});
  ~SolverProcess() { cancel(); }
  SolverProcess(const SolverProcess&) = delete;
  SolverProcess& operator=(const SolverProcess&) = delete;

  // Begins a case, also given as JSON text; cancels one that is still being solved. poll() returns any failure.
  void start(const metrology::Dataset& dataset, std::string_view text);

  // Returns the answer once; nothing while the solver works. Refusals: those of solve(), too-long (processor or elapsed
  // time), too-much-memory, solver-ended.
  std::optional<metrology::Solved> poll();

  // Ends the solver without an answer.
  void cancel();

  // Readable when poll() has an answer; -1 while nothing is being solved.
  int descriptor() const { return end_.get(); }

 private:
  std::optional<metrology::Refusal> launch(std::string_view text);
  metrology::Solved answerOf(int status);

  std::filesystem::path program_;
  SolverLimits limits_;
  std::optional<metrology::Solved> at_once_;
  pid_t child_{};
  io::Descriptor end_;  // of the process: a pidfd
  io::Descriptor answer_;
  std::chrono::steady_clock::time_point until_{};  // real time, whatever the emulated machine's scale
};

}  // namespace probebox::app
