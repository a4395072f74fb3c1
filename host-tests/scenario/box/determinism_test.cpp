#include <array>
#include <gtest/gtest.h>

#include "host-tests/emulation/scenario.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

std::vector<std::byte> bytesOf(std::uint64_t seed) {
  Scenario scenario{usualWorld(), seed};
  scenario.inject(world::FaultKind::probe_silent, 2s, 100ms);
  scenario.run(5s);
  return scenario.recorded().bytes;
}

TEST(Determinism, TheSameSeedGivesTheSameBytes) {
  const auto first = bytesOf(3);
  EXPECT_GT(first.size(), 100'000U);
  EXPECT_EQ(first, bytesOf(3));
  EXPECT_NE(first, bytesOf(4));
}

TEST(Determinism, AReplayedJournalGivesTheSameBytes) {
  Scenario scenario;
  scenario.keepEvents(true);
  scenario.inject(world::FaultKind::sync_silent, 2s, 500ms);
  scenario.run(5s);
  std::vector<Event> journal;
  std::array<std::byte, 256> buffer;
  for (const auto& event : scenario.events()) {
    const auto size = messages::encode(event, buffer);
    ASSERT_TRUE(size);
    const auto decoded = messages::decode<Event>(std::span{buffer}.first(*size));
    ASSERT_TRUE(decoded);
    journal.push_back(*decoded);
  }
  ASSERT_GT(journal.size(), 10'000U);
  EXPECT_EQ(replay(journal).bytes, scenario.recorded().bytes);
  journal.erase(journal.begin() + 9000);
  EXPECT_NE(replay(journal).bytes, scenario.recorded().bytes);
}

}  // namespace
}  // namespace probebox::scenario
