#include "tools/case/solve_here.hpp"

#include "firmware/metrology/solve.hpp"
#include "firmware/metrology/within_memory.hpp"

namespace probebox::casefolder {

metrology::Solved solveHere(const metrology::Dataset& dataset) {
  const metrology::Refusal too_much{
      "too-much-memory",
      "the case takes more memory than this computer has: leave out readings, and check that all stamps are of one "
      "clock, in seconds"};
  return metrology::withinMemory([&] { return metrology::solve(dataset); }, too_much);
}

}  // namespace probebox::casefolder
