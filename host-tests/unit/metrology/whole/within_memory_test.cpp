#include "firmware/metrology/within_memory.hpp"

#include <gtest/gtest.h>
#include <new>
#include <stdexcept>

namespace probebox::metrology {
namespace {

TEST(WithinMemory, RefusesWhatMemoryDoesNotHold) {
  const Refusal too_much{"too-much-memory", "leave out readings"};
  const Solved known = Refusal{"few", "few readings"};
  EXPECT_EQ(withinMemory([&] { return known; }, too_much).error().name, "few");
  const auto nameAfter = [&](const auto& failure) {
    return withinMemory([&]() -> Solved { throw failure; }, too_much).error().name;
  };
  EXPECT_EQ(nameAfter(std::bad_alloc{}), "too-much-memory");
  EXPECT_EQ(nameAfter(std::length_error{"vector"}), "too-much-memory");
}

}  // namespace
}  // namespace probebox::metrology
