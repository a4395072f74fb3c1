#pragma once
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/solve.hpp"
#include "protocol/units/outcome.hpp"

// The end of the solver's process: what `probeboxd --solver` does.
namespace probebox::app {

// What one case may take.
struct SolverLimits {
  std::chrono::seconds processor{60};
  std::chrono::seconds patience{120};     // by the clock on the wall
  std::size_t memory_bytes{256U << 20U};  // of addresses, code included
  std::size_t answer_bytes{16U << 20U};
};

// The argument of --solver that carries the limits to the child, "60,256".
std::string toArgument(const SolverLimits& limits);

// Solve the case that standard input holds as JSON, and write the answer to standard output: encodeAnswer(). Gives up
// rights and sets limits first, so that a case can do no more than end this process. Gives the exit status.
int solveInChild(std::string_view argument);

// The answer of a solver as text, and back. An error: the text is no answer.
std::string encodeAnswer(const metrology::Solved& solved);
Outcome<metrology::Solved> decodeAnswer(std::string_view text);

// The refusal of a case that takes more than the limits, by name: too-long, too-much-memory.
metrology::Refusal tooLong(const SolverLimits& limits);
metrology::Refusal tooMuchMemory(const SolverLimits& limits);

}  // namespace probebox::app
