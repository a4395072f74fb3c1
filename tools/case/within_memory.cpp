#include "tools/case/within_memory.hpp"

#include <new>
#include <stdexcept>

namespace probebox::casefolder {
namespace {

metrology::Refusal tooMuchMemory() {
  return {"too-much-memory",
          "the case takes more memory than this computer has: leave out readings, and check that all stamps are of one "
          "clock, in seconds"};
}

}  // namespace

metrology::Solved withinMemory(const std::function<metrology::Solved()>& solve) {
  try {
    return solve();
  } catch (const std::bad_alloc&) {
    return tooMuchMemory();
  } catch (const std::length_error&) {
    return tooMuchMemory();
  }
}

}  // namespace probebox::casefolder
