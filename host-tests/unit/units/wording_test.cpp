#include "protocol/units/wording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "protocol/units/megabytes.hpp"

namespace probebox {
namespace {

using testing::HasSubstr;

TEST(PersonsName, MayBeOfAnyScript) {
  for (const auto* name : {"Ada", "A", "Zoë O'Neil-Šimić", "李 明", "محمد", "Ада", "shift 2 (night)"})
    EXPECT_FALSE(whyNoName(name)) << name;
}

TEST(InMegabytes, HasOneDecimal) {
  EXPECT_EQ(inMegabytes(62'449'999), "62.4 MB");
  EXPECT_EQ(inMegabytes(0), "0.0 MB");
}

TEST(PersonsName, IsNotBlank) {
  for (const auto* name : {"", " ", "   ", "\u00A0", "\u2003 \u3000", "\u2800"}) {
    ASSERT_TRUE(whyNoName(name)) << '[' << name << ']';
    EXPECT_THAT(whyNoName(name)->what, HasSubstr("blank"));
  }
}

TEST(PersonsName, HasNoLineBreakControlOrCharacterThatMisleads) {
  struct Case {
    std::string name;
    const char* why;
  };
  for (const auto& [name, why] :
       {Case{"Ada\n2026 17 active by Bob", "a line break (U+000A)"}, Case{"Ada\rBob", "a line break"},
        Case{"Ada\u2028Bob", "a line break (U+2028)"}, Case{"Ada\x1b[2J", "a control character (U+001B)"},
        Case{"Ada\u009B2J", "a control character (U+009B)"},
        Case{std::string{"A\0da", 4}, "a control character (U+0000)"}, Case{"Ada\u202Eboss", "turns the direction"},
        Case{"Ada\u2066boss", "turns the direction"}, Case{"A\u200Bda", "an invisible character"},
        Case{"Ada\xFF", "no UTF-8"}, Case{"Ada\xC0\x8A", "no UTF-8"}, Case{"Ada\xED\xA0\x80", "no UTF-8"},
        Case{"Ada\xE2\x80", "no UTF-8"}}) {
    const auto refused = whyNoName(name);
    ASSERT_TRUE(refused) << name;
    EXPECT_THAT(refused->what, HasSubstr(why));
    EXPECT_FALSE(whyUnprintable(refused->what)) << "the refusal itself can be shown";
  }
}

TEST(PersonsName, HasAtMostAHundredCharacters) {
  std::string umlauts;
  for (std::size_t k = 0; k < kLongestName; ++k) umlauts += "ü";
  EXPECT_FALSE(whyNoName(umlauts)) << "characters, not bytes";
  ASSERT_TRUE(whyNoName(umlauts + "u"));
  EXPECT_THAT(whyNoName(umlauts + "u")->what, HasSubstr("101 characters"));
}

TEST(Shown, IsOneLineThatNoTerminalObeys) {
  EXPECT_EQ(shown("tip 6 mm, µm"), "tip 6 mm, µm");
  EXPECT_EQ(shown("a\x1b[31mb\nc\td\u009Be\u202Ef\xFFg"), "a?[31mb?c?d?e?f?g");
  EXPECT_EQ(shown("αβγδ", 2), "αβ...");
  EXPECT_EQ(shown("αβ", 2), "αβ");
}

TEST(Shown, KeepsLinesWhereThereAreSeveral) {
  EXPECT_EQ(shownLines("a\tb\nc\rd\x1b"), "a\tb\nc?d?");
}

}  // namespace
}  // namespace probebox
