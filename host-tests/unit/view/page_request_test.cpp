#include "tools/probebox/view/page_request.hpp"

#include <array>
#include <cstdint>
#include <gtest/gtest.h>
#include <string>

// What the page asks for.
namespace probebox::view {
namespace {

TEST(PageRequest, IsReadByItsKeys) {
  PageRequest asked{R"({"run": 7, "speeds": [5, 10.5], "by": "Ada", "yes": true, "axis": "B"})"};
  EXPECT_EQ(asked.count<std::uint32_t>("run"), 7U);
  EXPECT_EQ(asked.numbers("speeds"), (std::vector<double>{5, 10.5}));
  EXPECT_EQ(asked.text("by"), "Ada");
  EXPECT_TRUE(asked.flag("yes"));
  EXPECT_EQ(asked.axis(), 5);
  EXPECT_FALSE(asked.trouble());
}

TEST(PageRequest, HasTheMethodsOwnWhereAKeyIsAbsent) {
  PageRequest asked{"{}"};
  EXPECT_EQ(asked.number("overtravel_mm"), 0);
  EXPECT_TRUE(asked.numbers("speeds").empty());
  EXPECT_EQ(asked.axis(), 0);
  EXPECT_FALSE(asked.flag("yes"));
  EXPECT_FALSE(asked.trouble());
}

TEST(PageRequest, HasToBeAnObject) {
  for (const char* text : {"", "{", "7", "null", "[]", R"([{"run": 7}])", R"("run")"}) {
    PageRequest asked{text};
    EXPECT_EQ(asked.count<std::uint32_t>("run"), 0U) << text;
    ASSERT_TRUE(asked.trouble()) << text;
    EXPECT_EQ(asked.trouble()->what, "a request has to be a JSON object") << text;
  }
}

TEST(PageRequest, RefusesAValueOfTheWrongTypeByItsKey) {
  struct Wrong {
    const char* text;
    void (*read)(PageRequest&);
    const char* key;
  };
  const std::array<Wrong, 8> all{{
      {R"({"angles": null})", [](PageRequest& asked) { asked.number("angles"); }, "angles"},
      {R"({"angles": "7"})", [](PageRequest& asked) { asked.count<std::uint16_t>("angles"); }, "angles"},
      {R"({"angles": 2.5})", [](PageRequest& asked) { asked.count<std::uint16_t>("angles"); }, "angles"},
      {R"({"angles": 65536})", [](PageRequest& asked) { asked.count<std::uint16_t>("angles"); }, "angles"},
      {R"({"angles": -1})", [](PageRequest& asked) { asked.count<std::uint16_t>("angles"); }, "angles"},
      {R"({"speeds": [5, null]})", [](PageRequest& asked) { asked.numbers("speeds"); }, "speeds"},
      {R"({"by": 7})", [](PageRequest& asked) { asked.text("by"); }, "by"},
      {R"({"axis": "Q"})", [](PageRequest& asked) { asked.axis(); }, "axis"},
  }};
  for (const auto& wrong : all) {
    PageRequest asked{wrong.text};
    wrong.read(asked);
    ASSERT_TRUE(asked.trouble()) << wrong.text;
    EXPECT_EQ(asked.trouble()->what.rfind(std::string{wrong.key} + " has to be ", 0), 0U) << asked.trouble()->what;
  }
}

}  // namespace
}  // namespace probebox::view
