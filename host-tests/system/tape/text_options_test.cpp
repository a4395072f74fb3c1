#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/app/cnc/text_server.hpp"

namespace probebox::app {
namespace {

using testing::HasSubstr;

TEST(TextOptions, HaveTheUsualSettingsOfTheirKindOfLine) {
  const auto tape = *parseTextOptions("tape:/dev/ttyS1,dialect=nv,first=7,offset=3,reader=all");
  ASSERT_TRUE(tape.ok());
  EXPECT_EQ(serial::describe((*tape).line.settings), "9600 7E2");
  EXPECT_TRUE((*tape).flow);
  EXPECT_EQ((*tape).form.first, 7);
  EXPECT_EQ((*tape).usual, tape::Ask::all);
  const auto records = *parseTextOptions("records:/dev/ttyS1,baud=38400,parity=none");
  ASSERT_TRUE(records.ok());
  EXPECT_EQ(serial::describe((*records).line.settings), "38400 8N1");
  EXPECT_FALSE((*records).flow);
  EXPECT_FALSE(parseTextOptions("modbus:/dev/ttyS1"));
}

TEST(TextOptions, AreRefusedByName) {
  for (const char* text : {"tape:/dev/ttyS1,dialect=iso", "tape:/dev/ttyS1,offset=10", "tape:/dev/ttyS1,every=100",
                           "records:/dev/ttyS1,every=5", "records:/dev/ttyS1,dialect=g10", "records:"}) {
    const auto options = *parseTextOptions(text);
    EXPECT_FALSE(options.ok()) << text;
  }
}

TEST(TextOptions, KnowHowFastALineIs) {
  const auto slow = *parseTextOptions("records:/dev/ttyS1,every=20");
  ASSERT_FALSE(slow.ok());
  EXPECT_THAT(slow.error().what, testing::AllOf(HasSubstr("19200"), HasSubstr("8E1"), HasSubstr("every=35")));
  EXPECT_TRUE(parseTextOptions("records:/dev/ttyS1,every=35")->ok());
  EXPECT_TRUE(parseTextOptions("records:/dev/ttyS1,every=20,baud=38400")->ok());
}

}  // namespace
}  // namespace probebox::app
