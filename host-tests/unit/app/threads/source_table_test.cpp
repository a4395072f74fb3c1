#include "firmware/app/threads/source_table.hpp"

#include <array>
#include <gmock/gmock.h>

#include "host-tests/support/no_alloc.hpp"

namespace probebox::app {
namespace {

constexpr std::array<io::SourceFault, 2> kNames{
    {{"converter-silent", "it does not answer"}, {"watchdog", "it began anew"}}};

// The thread that reads the sources tells faults, which may come and go quickly.
TEST(SourceTable, NamesTheFaultsOfASourceWithoutMemoryOfTheThreadThatTellsThem) {
  SourceTable table;
  table.add("a line");
  table.add("a receiver", kNames);
  const support::NoAlloc no_alloc;
  table.tellFaults(1, 0b10);
  EXPECT_EQ(no_alloc.allocations(), 0U);
  EXPECT_EQ(table.rows()[0].faults, "");
  EXPECT_THAT(table.rows()[1].faults,
              testing::AllOf(testing::HasSubstr("watchdog"), testing::Not(testing::HasSubstr("converter-silent"))));
  table.tellFaults(1, 0);
  EXPECT_EQ(table.rows()[1].faults, "");
}

}  // namespace
}  // namespace probebox::app
