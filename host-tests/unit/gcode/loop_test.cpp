#include "tools/gcode/loop/loop.hpp"

#include <gmock/gmock.h>
#include <regex>
#include <set>
#include <sstream>

#include "protocol/modbus/map.hpp"
#include "tools/gcode/loop/areas.hpp"
#include "tools/gcode/loop/program_text.hpp"

namespace probebox::gcode::loop {
namespace {

using testing::HasSubstr;

TEST(LoopText, SaysThatItWasNotRunOnAControlAndWhatTheControlNeeds) {
  for (const char* dialect : {"fanuc", "siemens"}) {
    const auto text = loopProgram(dialect, "XYZABC");
    ASSERT_TRUE(text) << text.error().what;
    std::string head;
    for (const char c : text->substr(0, 4000)) head += c == '\n' || c == '(' || c == ')' || c == ';' ? ' ' : c;
    EXPECT_THAT(std::regex_replace(head, std::regex{" +"}, " "),
                testing::AllOf(HasSubstr("THIS PROGRAM WAS NOT RUN ON A CONTROL"), HasSubstr("THE BOX ONLY ADVISES")));
    EXPECT_THAT(*text, HasSubstr("REGISTERS 834 TO 893 INTO WORDS 64 TO 123"));
    std::istringstream lines{*text};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 160U) << line;
  }
}

TEST(LoopText, RefusesAHaasWithTheRemedy) {
  const auto text = loopProgram("haas", "XYZABC");
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().what, HasSubstr("probebox gcode METHOD --dialect haas"));
  EXPECT_FALSE(loopProgram("linuxcnc", "XYZABC")) << "its loop program is the kit";
}

TEST(LoopText, StopsWhereAStepTurnsAnAxisThatIsNotThere) {
  EXPECT_THAT(*loopProgram("fanuc", "XYZBC"), HasSubstr("A STEP TURNS AN AXIS THAT IS NOT THERE: A"));
  EXPECT_THAT(*loopProgram("fanuc", "XYZABC"), testing::Not(HasSubstr("THAT IS NOT THERE")));
  EXPECT_THAT(*loopProgram("fanuc", "XYZCB"), HasSubstr("#5024")) << "C is the fourth axis";
}

TEST(Areas, AreWhatTheBoxTakesInOneRequest) {
  for (const auto& area : areasRead()) EXPECT_LE(area.count, 125);
  std::set<unsigned> taken;
  for (const auto areas : {areasRead(), areasWritten()}) {
    for (const auto& area : areas) {
      for (unsigned word = area.word; word < area.word + 0U + area.count; ++word)
        EXPECT_TRUE(taken.insert(word).second) << "word " << word << " belongs to two areas";
    }
  }
  for (const auto& area : areasWritten()) {
    for (unsigned at = area.first; at < area.first + 0U + area.count; ++at) {
      const auto* entry = modbus::covering(static_cast<std::uint16_t>(at));
      ASSERT_NE(entry, nullptr) << "register " << at << " would be refused";
      EXPECT_EQ(entry->access, modbus::Access::write) << at;
    }
  }
}

TEST(Areas, HaveValuesOf32BitsAtMultiplesOfFourBytes) {
  for (const auto& entry : modbus::registers()) {
    if (modbus::registersOf(entry.kind) != 2) continue;
    for (const auto areas : {areasRead(), areasWritten()}) {
      for (const auto& area : areas) {
        if (entry.address < area.first || entry.address >= area.first + area.count) continue;
        EXPECT_EQ((area.word + entry.address - area.first) % 2, 0) << entry.name;
      }
    }
  }
}

TEST(ProgramText, NamesTheLineThatItCannotRead) {
  const auto whyNot = [](const char* text) {
    const auto read = subprogramsOf(text);
    return read ? std::string{} : read.error().what;
  };
  EXPECT_THAT(whyNot("o<probebox_x> sub\n#<a> = [1 +]\no<probebox_x> endsub\n"), HasSubstr("line 2"));
  EXPECT_THAT(whyNot("o<probebox_x> sub\no1 if [1 EQ 1]\no<probebox_x> endsub\n"), HasSubstr("no end"));
  EXPECT_THAT(whyNot("G1 X1\n"), HasSubstr("outside"));
  EXPECT_THAT(whyNot("o<probebox_x> sub\n"), HasSubstr("missing"));
}

}  // namespace
}  // namespace probebox::gcode::loop
