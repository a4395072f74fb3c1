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

// Solves one case at a time in a process of its own, which holds no lock, no memory of the daemon and no rights: a case
// that takes too much, or ends the process, is refused, and the daemon goes on. One thread.
class SolverProcess {
 public:
  // program: the probeboxd whose `--solver` is run. Empty: start() solves at once in the calling thread, for programs
  // that embed the daemon's parts.
  explicit SolverProcess(std::filesystem::path program, SolverLimits limits = {});
  ~SolverProcess() { cancel(); }
  SolverProcess(const SolverProcess&) = delete;
  SolverProcess& operator=(const SolverProcess&) = delete;

  // Begins a case, given as its JSON text too; one that is still being solved is cancelled. What goes wrong is answered
  // by poll().
  void start(const metrology::Dataset& dataset, std::string_view text);

  // The answer, once; nothing while the solver works. Refuses what solve() does, and by name: too-long (of the
  // processor or by the clock), too-much-memory, solver-ended.
  std::optional<metrology::Solved> poll();

  // Ends the solver, and there is no answer.
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
