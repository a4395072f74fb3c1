#pragma once
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/solve.hpp"
#include "protocol/units/outcome.hpp"

// The child's side of the solver process, `probeboxd --solver`.
namespace probebox::app {

// Limits for one case.
struct SolverLimits {
  std::chrono::seconds processor{60};
  std::chrono::seconds patience{120};     // elapsed time
  std::size_t memory_bytes{256U << 20U};  // address space, including code
  std::size_t answer_bytes{16U << 20U};
};

// The argument of --solver that carries the limits to the child, "60,256".
std::string toArgument(const SolverLimits& limits);

// Solves a case, JSON from the standard input, and writes encodeAnswer() to the standard output. Drops rights, sets
// limits and filters system calls first, so that a case can at most end this process; where the kernel does not let it,
// every case is refused. Returns the exit status.
int solveInChild(std::string_view argument);

// Converts the answer of a solver to text and back. Error: the text is no answer.
std::string encodeAnswer(const metrology::Solved& solved);
Outcome<metrology::Solved> decodeAnswer(std::string_view text);

// Refusals of a case that exceeds the limits: too-long, too-much-memory.
metrology::Refusal tooLong(const SolverLimits& limits);
metrology::Refusal tooMuchMemory(const SolverLimits& limits);

}  // namespace probebox::app
