#include "tools/probebox/cli/console.hpp"

#include <gtest/gtest.h>
#include <sstream>

namespace probebox::command {
namespace {

std::string shownOn(std::size_t columns, const std::string& text, bool is_terminal = true) {
  std::istringstream in;
  std::ostringstream out, err;
  const std::atomic<bool> never{false};
  Console console{{in, out, err, is_terminal, false, columns, never}, false};
  console.line(text);
  return out.str();
}

const std::string kWarning =
    "storage            One subject stands for one quantity since this version: measure it again";

TEST(Console, BreaksLongLinesUnderTheirText) {
  EXPECT_EQ(shownOn(60, kWarning),
            "storage            One subject stands for one quantity since\n"
            "                   this version: measure it again\n");
  EXPECT_EQ(shownOn(60, "result 8 is in force\n  The slope is that of the slide which carries the chuck, not of C."),
            "result 8 is in force\n"
            "  The slope is that of the slide which carries the chuck,\n"
            "    not of C.\n");
  const std::string exact(60, 'x');
  EXPECT_EQ(shownOn(60, exact), exact + "\n");
  EXPECT_EQ(shownOn(60, "a " + exact + exact + " b"), "a\n  " + exact + exact + "\n  b\n") << "no word is cut";
}

TEST(Console, LeavesLinesWholeForProgramsAndWhereNothingIsKnownOfTheTerminal) {
  EXPECT_EQ(shownOn(60, kWarning, false), kWarning + "\n");
  EXPECT_EQ(shownOn(0, kWarning), kWarning + "\n");
  EXPECT_EQ(shownOn(20, kWarning), kWarning + "\n");
}

}  // namespace
}  // namespace probebox::command
