#pragma once
#include <cstdint>

namespace probebox::support {

// Counts the allocations of this thread (malloc and operator new) while it lives. Link no_alloc.cpp into the test.
//
//   const NoAlloc guard;
//   estimator.push(edge);
//   EXPECT_EQ(guard.allocations(), 0);
class NoAlloc {
 public:
  NoAlloc();
  std::uint64_t allocations() const;

 private:
  std::uint64_t before_;
};

}  // namespace probebox::support
