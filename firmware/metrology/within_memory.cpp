#include "firmware/metrology/within_memory.hpp"

#include <new>
#include <stdexcept>

namespace probebox::metrology {

Solved withinMemory(const std::function<Solved()>& work, const Refusal& too_much) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return too_much;
  } catch (const std::length_error&) {
    return too_much;
  }
}

}  // namespace probebox::metrology
