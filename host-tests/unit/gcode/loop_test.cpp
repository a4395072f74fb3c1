#include "tools/gcode/loop/loop.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <regex>
#include <set>
#include <sstream>

#include "protocol/modbus/map.hpp"
#include "tools/gcode/loop/areas.hpp"
#include "tools/gcode/loop/locals.hpp"
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
                testing::AllOf(HasSubstr("NOT RUN"), HasSubstr("ONLY ADVISES")));
    EXPECT_THAT(*text,
                testing::AllOf(HasSubstr("834 TO"), HasSubstr("TO 939"), HasSubstr("64 TO"), HasSubstr("TO 169")));
    std::istringstream lines{*text};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 160U) << line;
  }
}

// As one line of words.
std::string saidIn(const std::string& text) {
  std::string all;
  for (const char c : text) all += c == '\n' || c == '(' || c == ')' || c == ';' ? ' ' : c;
  return std::regex_replace(all, std::regex{" +"}, " ");
}

TEST(LoopText, SaysThatTheProbeIsToBeSwitchedOn) {
  for (const char* dialect : {"fanuc", "siemens"})
    EXPECT_THAT(saidIn(*loopProgram(dialect, "XYZABC")), HasSubstr("SWITCHED ON")) << dialect;
}

TEST(LoopText, SaysWhatAFanucLosesAndTakesNumbersThatNoMacroCallHas) {
  const auto text = *loopProgram("fanuc", "XYZBC");
  EXPECT_THAT(saidIn(text), testing::AllOf(HasSubstr("#100 TO"), HasSubstr("#199"), HasSubstr("#550 TO"),
                                           HasSubstr("#999"), HasSubstr("G65 P8700"), HasSubstr("G43 H")));
  const std::regex number{R"((?:^|\n)O(\d+) |[MG](?:98|65) P(\d+))"};
  const auto numbersIn = [&](const std::string& of) {
    std::set<int> numbers;
    for (std::sregex_iterator one{of.begin(), of.end(), number}, end; one != end; ++one)
      numbers.insert(std::stoi((*one)[1].matched ? (*one)[1] : (*one)[2]));
    return numbers;
  };
  EXPECT_GE(*numbersIn(text).begin(), 8700);
  EXPECT_LE(*numbersIn(text).rbegin(), 8749);
  EXPECT_EQ(*numbersIn(*loopProgram("fanuc", "XYZBC", 1200)).begin(), 1200);
  EXPECT_LE(*numbersIn(*loopProgram("fanuc", "XYZBC", 1200)).rbegin(), 1249);
  EXPECT_FALSE(loopProgram("fanuc", "XYZBC", 8980)) << "9000 and more are the builder's";
  EXPECT_FALSE(loopProgram("siemens", "XYZBC", 1200)) << "no number there";
  const std::regex assigned{R"((?:^|\n)#(\d+)=)"};
  for (std::sregex_iterator one{text.begin(), text.end(), assigned}, end; one != end; ++one) {
    const int variable = std::stoi((*one)[1]);
    EXPECT_TRUE(variable == 1133 || variable == 3000 || (variable >= 100 && variable < 200) || variable >= 550)
        << variable;
  }
}

TEST(LoopText, MovesInAFrameOfAFanucThatIsChosen) {
  EXPECT_THAT(*loopProgram("fanuc", "XYZABC"),
              testing::AllOf(HasSubstr("\nG54.1 P48\n"), HasSubstr("G10 L20 P48"), HasSubstr("#7941")));
  EXPECT_THAT(*loopProgram("fanuc", "XYZABC", kFirstProgram, 3),
              testing::AllOf(HasSubstr("\nG54.1 P3\n"), HasSubstr("G10 L20 P3 "), HasSubstr("#7041")));
  EXPECT_THAT(*loopProgram("fanuc", "XYZABC", kFirstProgram, 0),
              testing::AllOf(HasSubstr("\nG59\n"), HasSubstr("G10 L2 P6"), HasSubstr("#5321")));
  EXPECT_FALSE(loopProgram("siemens", "XYZABC", kFirstProgram, 3));
}

TEST(LoopText, NamesInItsCommentsWhatThisControlHas) {
  for (const char* dialect : {"fanuc", "siemens"}) {
    const auto text = saidIn(*loopProgram(dialect, "XYZABC"));
    for (const char* kits : {".NGC", "METHOD #1 ", "1200 +", "G59.3", "(G8", " G8 ", " PROBEBOX_", "#<"})
      EXPECT_THAT(text, testing::Not(HasSubstr(kits))) << dialect;
  }
  EXPECT_THAT(saidIn(*loopProgram("fanuc", "XYZABC")), HasSubstr("#800 +"));
  EXPECT_THAT(saidIn(*loopProgram("siemens", "XYZABC")), HasSubstr("PBT_N[200 +"));
}

TEST(LoopText, SaysThatASiemensCountsCOn) {
  const auto text = saidIn(*loopProgram("siemens", "XYZABC"));
  const auto head = text.substr(0, text.find("AREAS THAT THE PLC TRANSFERS"));
  EXPECT_THAT(head, testing::AllOf(HasSubstr("MD 30310"), HasSubstr("NO MODULO"), HasSubstr("LONG WAY")));
}

TEST(LoopText, RefusesNumbersWhosePlacesBelongToOthers) {
  EXPECT_THAT(*loopProgram("siemens", "XYZABC"), testing::AllOf(testing::ContainsRegex(R"(PBL_N\[[0-9]+\]<=99 GOTO)"),
                                                                testing::ContainsRegex(R"(PBL_N\[[0-9]+\]<=9 GOTO)")));
}

TEST(LoopText, StopsForABallOfALatheInOtherWordsThanForAPlate) {
  for (const char* dialect : {"fanuc", "siemens"}) {
    EXPECT_THAT(*loopProgram(dialect, "XYZABC"),
                testing::AllOf(HasSubstr("BALL FURTHER OUT"), HasSubstr("BALL AS AT FIRST"), HasSubstr("PUT PLATE IN")))
        << dialect;
  }
}

TEST(LoopText, DefinesEachNameOnceForSiemens) {
  const auto text = *loopProgram("siemens", "XYZABC");
  EXPECT_THAT(saidIn(text), HasSubstr("EXTERN PROBEBOX REAL, REAL, REAL, REAL, REAL, REAL"));
  std::set<std::string> names;
  const std::regex defined{R"((?:^|\n)(?:PROC|DEF CHAN REAL|DEF CHAN INT) (\w+)|REAL (PBP_\w+))"};
  for (std::sregex_iterator one{text.begin(), text.end(), defined}, end; one != end; ++one) {
    const std::string name = (*one)[1].matched ? (*one)[1] : (*one)[2];
    EXPECT_TRUE(names.insert(name).second) << name << " is defined twice";
    EXPECT_LE(name.size(), 31U) << name;
  }
  EXPECT_GT(names.size(), 50U);
  // A control as shipped has room for few names of GUD, and the text states how many it needs.
  std::size_t defined_names = 0;
  for (auto at = text.find("\nDEF CHAN"); at != std::string::npos; at = text.find("\nDEF CHAN", at + 1))
    ++defined_names;
  EXPECT_LT(defined_names, 70U);
  EXPECT_THAT(saidIn(text),
              testing::AllOf(HasSubstr("MM_NUM_GUD_NAMES_CHAN: " + std::to_string(defined_names) + " MORE"),
                             HasSubstr("MM_GUD_VALUES_MEM")));
  EXPECT_THAT(text, testing::AllOf(HasSubstr("G710"), testing::Not(HasSubstr("G71 "))));
}

TEST(LoopText, SharesPlacesOfVariablesThatAreNeverInUseTogether) {
  const auto all = subprogramsOf(
      "o<probebox_main> sub\n#<kept> = 1\no<probebox_one> call [#<kept>]\no<probebox_other> call [2]\no<probebox_main> "
      "endsub\n"
      "o<probebox_one> sub\n#<x> = #1\no<probebox_deep> call [#<x>]\no<probebox_one> endsub\n"
      "o<probebox_other> sub\n#<y> = #1\no<probebox_deep> call [3]\n#<z> = #<y>\no<probebox_other> endsub\n"
      "o<probebox_deep> sub\n#<w> = #1\no<probebox_deep> endsub\n");
  ASSERT_TRUE(all) << all.error().what;
  const auto places = placesOfLocals(*all);
  EXPECT_EQ(places.at("main/kept"), 0U);
  EXPECT_EQ(std::min(places.at("one/1"), places.at("one/x")), 1U);
  EXPECT_EQ(std::min({places.at("other/1"), places.at("other/y"), places.at("other/z")}), 1U);
  EXPECT_EQ(std::min(places.at("deep/1"), places.at("deep/w")), 4U) << "behind those of all that call it";
}

TEST(LoopText, RefusesAHaasWithTheRemedy) {
  const auto text = loopProgram("haas", "XYZABC");
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().what, HasSubstr("--dialect haas"));
  EXPECT_FALSE(loopProgram("linuxcnc", "XYZABC")) << "its loop program is the kit";
}

TEST(LoopText, StopsWhereAStepTurnsAnAxisThatIsNotThere) {
  EXPECT_THAT(*loopProgram("fanuc", "XYZBC"), HasSubstr("THAT IS NOT THERE: A"));
  EXPECT_THAT(*loopProgram("fanuc", "XYZABC"), testing::Not(HasSubstr("THAT IS NOT THERE")));
  EXPECT_THAT(*loopProgram("fanuc", "XYZCB"), HasSubstr("#5024")) << "C is the fourth axis";
}

TEST(LoopText, HasNoWordOfAMillForALathe) {
  const auto fanuc = *loopProgram("fanuc-lathe", "");
  for (const char* code : {R"(G9[0-5]\b)", R"(G4[39]\b)", R"(G17\b)", R"(\bM6\b)", R"(\bM19\b)", R"([^\w(]Y#)"}) {
    std::istringstream lines{fanuc};
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("(")) continue;
      EXPECT_FALSE(std::regex_search(line, std::regex{code})) << line;
    }
  }
  EXPECT_THAT(fanuc, testing::AllOf(HasSubstr("\nG18 G21 G40 G80\nG98 G61\n"), HasSubstr("\nG59\n"), HasSubstr("#5321"),
                                    HasSubstr("\n#112=#5042\n")))
      << "Z is the second axis";
  EXPECT_THAT(saidIn(fanuc), testing::AllOf(HasSubstr("NOT RUN"), HasSubstr("DIAMETERS"), HasSubstr("T0100")));
  const auto siemens = *loopProgram("siemens-lathe", "");
  EXPECT_THAT(siemens, testing::AllOf(HasSubstr("\nDIAMOF\n"), testing::Not(HasSubstr("\nM6\n")),
                                      testing::Not(HasSubstr(" Y=PBV")), testing::Not(HasSubstr("SPOS"))));
  EXPECT_THAT(saidIn(siemens), testing::AllOf(HasSubstr("NOT RUN"), HasSubstr("X IN RADIUS")));
}

TEST(LoopText, KnowsALatheThatHasAYByItsAxes) {
  const auto text = *loopProgram("fanuc-lathe", "XZYC");
  EXPECT_THAT(text, testing::AllOf(HasSubstr("G31 X#110 Y#111 Z#112 F#113"), HasSubstr("[#5043-#111]"),
                                   HasSubstr("[#5042-#112]"), HasSubstr("G17 G21")));
  EXPECT_FALSE(loopProgram("fanuc-lathe", "XYC")) << "no Z";
  EXPECT_FALSE(loopProgram("fanuc", "XZC")) << "a mill has a Y";
  EXPECT_FALSE(loopProgram("siemens-lathe", "XZCC"));
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
