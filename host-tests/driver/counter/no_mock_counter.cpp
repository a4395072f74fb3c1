#include "mock_counter.hpp"

namespace probebox::counter {

std::unique_ptr<MockCounter> makeMockCounter() {
  return nullptr;
}

}  // namespace probebox::counter
