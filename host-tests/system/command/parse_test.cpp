#include "tools/probebox/cli/parse.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "firmware/procedure/methods/methods.hpp"
#include "in_process.hpp"
#include "tools/probebox/method_help.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::variant<Request, Answer> parsed(const std::string& line) {
  std::istringstream words{line};
  const std::vector<std::string> arguments{std::istream_iterator<std::string>{words}, {}};
  return parse(arguments, methodHelp());
}

std::string complaint(const std::string& line) {
  const auto outcome = parsed(line);
  const auto* answer = std::get_if<Answer>(&outcome);
  if (answer == nullptr) return "accepted";
  EXPECT_EQ(answer->status, ExitStatus::usage) << line;
  return answer->text;
}

TEST(CommandLine, UnderstandsTheOptionsOfACommand) {
  const auto request = std::get<Request>(parsed("-u tcp:localhost:7627 record -o scan.pbx --for 2.5 --policy live"));
  EXPECT_EQ(request.uri, "tcp:localhost:7627");
  EXPECT_FALSE(request.json);
  const auto record = std::get<Record>(request.job);
  EXPECT_EQ(record.output, "scan.pbx");
  EXPECT_EQ(record.seconds, 2.5);
  EXPECT_TRUE(record.live);
  EXPECT_FALSE(record.force);
}

TEST(CommandLine, TakesGeneralOptionsBeforeAndAfterTheCommand) {
  for (const auto* line :
       {"--json -u serial:/dev/ttyS0,baud=921600 status", "status --json -u serial:/dev/ttyS0,baud=921600"}) {
    const auto request = std::get<Request>(parsed(line));
    EXPECT_TRUE(request.json);
    EXPECT_EQ(request.uri, "serial:/dev/ttyS0,baud=921600");
  }
}

TEST(CommandLine, KeepsTheNewestSamplesOnlyWhenAskedTo) {
  EXPECT_FALSE(std::get<Record>(std::get<Request>(parsed("record -o a")).job).live);
}

TEST(CommandLine, ListsOnceUnlessToldToWatch) {
  const auto list = [](const std::string& line) { return std::get<List>(std::get<Request>(parsed(line)).job); };
  EXPECT_FALSE(list("list").watch);
  EXPECT_EQ(list("list --watch --count 3").until.count, 3U);
  EXPECT_THAT(complaint("list --for 3"), HasSubstr("--watch"));
}

TEST(CommandLine, IsPatientWithABoxThatHasGone) {
  EXPECT_EQ(std::get<Watch>(std::get<Request>(parsed("watch")).job).patience_s, 30);
  EXPECT_EQ(std::get<Record>(std::get<Request>(parsed("record -o a --patience 600")).job).patience_s, 600);
}

TEST(CommandLine, CalibratesTheDelayUnlessAnotherMethodIsNamed) {
  const auto calibrate = [](const std::string& line) {
    return std::get<Calibrate>(std::get<Request>(parsed(line)).job);
  };
  EXPECT_EQ(calibrate("calibrate").method, "delay-multi-speed");
  EXPECT_EQ(calibrate("calibrate sphere-fit").method, "sphere-fit");
  EXPECT_TRUE(calibrate("calibrate --abort").abort);
  EXPECT_EQ(calibrate("calibrate --abort").method, "") << "nothing is begun";
}

TEST(CommandLine, SuggestsWhatWasMeant) {
  EXPECT_THAT(complaint("stauts"), AllOf(HasSubstr("stauts"), HasSubstr("did you mean status?")));
  EXPECT_THAT(complaint("rec -o a"), HasSubstr("record?"));
  EXPECT_THAT(complaint("status --jsno"), HasSubstr("--json?"));
  EXPECT_THAT(complaint("record -o a --polciy=live"), HasSubstr("--policy?"));
  EXPECT_THAT(complaint("xyzzyplugh"), testing::Not(HasSubstr("did you mean")));
}

TEST(CommandLine, NamesWhatIsMissing) {
  EXPECT_THAT(complaint(""), HasSubstr("a command"));
  EXPECT_THAT(complaint("record"), HasSubstr("--output"));
  EXPECT_THAT(complaint("accept 3"), HasSubstr("--by"));
  EXPECT_THAT(complaint("rollback delay"), HasSubstr("--by"));
  EXPECT_THAT(complaint("rollback --by Ada"), HasSubstr("what"));
  EXPECT_THAT(complaint("solve"), HasSubstr("case"));
  EXPECT_THAT(complaint("calibrate delay-multi-speed --accept"), HasSubstr("--by NAME"));
  EXPECT_THAT(complaint("calibrate delay-multi-speed --abort"), HasSubstr("--abort"));
  EXPECT_THAT(complaint("status --uri"), HasSubstr("--uri"));
}

TEST(CommandLine, RefusesNumbersThatMakeNoSense) {
  for (const auto* line :
       {"watch --for -1", "watch --for nan", "watch --for inf", "watch --for 1s", "watch --for 0", "watch --count 2.5",
        "watch --count 0", "watch --count -3", "calibrate --overtravel nan", "calibrate --speed 10,inf",
        "calibrate --clearance -1", "accept zero --by Ada", "accept 99999999999999999999999 --by Ada",
        "certificate 1 -o a.html --next-due 2027-02-30", "certificate 1 -o a.html --next-due 0001-01-01"}) {
    EXPECT_THAT(complaint(line), AllOf(HasSubstr("such as"), HasSubstr("--help"))) << line;
  }
}

// As "$NAME" of a shell where it is not set.
TEST(CommandLine, RefusesAnEmptyName) {
  using Words = std::vector<std::string>;
  const auto refusal = [](const Words& words) {
    const auto outcome = parse(words, methodHelp());
    const auto* answer = std::get_if<Answer>(&outcome);
    return answer == nullptr ? "accepted" : answer->text;
  };
  for (const auto& words :
       {Words{"plan", "delay-multi-speed", "--machine", ""}, Words{"plan", "delay-multi-speed", "--probe", ""},
        Words{"plan", "delay-multi-speed", "--machine", "a", "--unit", ""},
        Words{"gcode", "delay-multi-speed", "--dialect", "haas", "-o", "a", "--picture", ""},
        Words{"view", "--cell", ""}, Words{"interference", "--cell", "", "--tool", "1", "--gcode", "a"},
        Words{"interference", "--cell", "a", "--tool", "1", "--gcode", ""}})
    EXPECT_THAT(refusal(words), HasSubstr("is empty")) << words.back();
  for (const auto& words :
       {Words{"solve", ""}, Words{"report", "", "-o", "a"}, Words{"propose", ""}, Words{"verify", ""},
        Words{"export", "", "-o", "a"}, Words{"replay", ""}, Words{"pack", "", "a"}, Words{"provision", ""},
        Words{"update", ""}, Words{"calibrate", ""}, Words{"calibrate", "--save", ""}, Words{"results", ""},
        Words{"history", ""}, Words{"inhibit", "off", "--by", "Ada", "--connection", ""}})
    EXPECT_THAT(refusal(words), HasSubstr("is empty")) << words.front();
}

TEST(CommandLine, TakesACaseOfNoMachineOnSomebodysWord) {
  const auto propose = std::get<Propose>(std::get<Request>(parsed("propose a --as-this-machine --by Ada")).job);
  EXPECT_TRUE(propose.as_this_machine);
  EXPECT_EQ(propose.by, "Ada");
  EXPECT_THAT(complaint("propose a --as-this-machine"), HasSubstr("--by"));
}

TEST(CommandLine, HomesAxesAtPositions) {
  EXPECT_EQ(std::get<Home>(std::get<Request>(parsed("home X=0 z=-12.5")).job).axes.size(), 2U);
  for (const auto* line : {"home", "home X", "home W=1", "home X=", "home X=nan", "home X=1mm"})
    EXPECT_THAT(complaint(line), testing::Not("accepted")) << line;
  EXPECT_THAT(complaint("home X"), HasSubstr("X=120.5"));
}

// A program with such a number would move a machine there.
TEST(CommandLine, WritesNoProgramWithWhatIsNoNumberOrPlace) {
  const std::string gcode = "gcode delay-multi-speed --dialect linuxcnc -o a.ngc ";
  for (const std::string option :
       {"--safe-z nan", "--safe-z inf", "--safe-z 1e9", "--at 0,nan,0", "--c-axis inf,0,0", "--table-axis 0,0,1e300",
        "--ball 1,2,inf", "--tilts 0,nan", "--tilts 400", "--probe-tools 0", "--head-tool -1", "--sphere nan"}) {
    const auto name = option.substr(0, option.find(' '));
    EXPECT_THAT(complaint(gcode + option), AllOf(HasSubstr(name), HasSubstr("is not"))) << option;
  }
  for (const std::string device : {"ttyS1", "/dev/tty(S1)", "/dev/x;M3"})
    EXPECT_THAT(complaint(gcode + "--tape " + device), HasSubstr("path")) << device;
}

TEST(CommandLine, WritesALoopProgramForAllMethodsAlone) {
  const std::string loop = "gcode --loop --dialect fanuc -o a.nc ";
  EXPECT_EQ(complaint(loop + "--axes XYZBC --number 8000 --force"), "accepted");
  EXPECT_THAT(complaint(loop + "delay-multi-speed"), HasSubstr("omit"));
  EXPECT_THAT(complaint(loop + "--speed 10"), AllOf(HasSubstr("--speed"), HasSubstr("--loop")));
  EXPECT_THAT(complaint("gcode --dialect fanuc -o a.nc"), HasSubstr("is missing"));
  EXPECT_THAT(complaint("gcode delay-multi-speed --dialect fanuc -o a.nc --axes XYZ"), HasSubstr("--loop"));
}

// A step that is no number would pass over every hit.
TEST(CommandLine, NamesTheRangeOfANumber) {
  const std::string check = "interference --cell cell.toml --gcode part.ngc ";
  for (const auto* step : {"nan", "0", "inf", "11"})
    EXPECT_THAT(complaint(check + "--tool 4 --step " + step), HasSubstr("0.01")) << step;
  for (const auto* tool : {"0", "100", "4.5", "-1"})
    EXPECT_THAT(complaint(check + "--tool " + tool), HasSubstr("to 99")) << tool;
  for (const auto* port : {"70000", "abc", "-1"})
    EXPECT_THAT(complaint(std::string{"view --port "} + port), HasSubstr("65535")) << port;
  for (const auto* seconds : {"nan", "601", "-1"})
    EXPECT_THAT(complaint(std::string{"record -o a --on-trigger --before "} + seconds), HasSubstr("600"));
}

TEST(CommandLine, NamesTheRangeOfACount) {
  for (const std::string wrong : {"--angles 1000000", "--angles 2.5", "--heights 0", "--turns -1"})
    EXPECT_THAT(complaint("calibrate centreline " + wrong), AllOf(HasSubstr("1 to"), HasSubstr("65535"))) << wrong;
  EXPECT_THAT(complaint("calibrate tool-setter --tool -1"), HasSubstr("from 1"));
  EXPECT_THAT(complaint("export a.pbx -o b --points --friction nan"), HasSubstr("0 to"));
}

TEST(CommandLine, TakesNoNameThatForgesAHistory) {
  using Words = std::vector<std::string>;
  for (const auto& name : {std::string{" "}, std::string{"Ada\n18 active by Bob"}, std::string{"Ada\u202Eboss"}}) {
    for (const auto& words : {Words{"accept", "3"}, Words{"rollback", "delay"}, Words{"calibrate", "--accept"}}) {
      auto all = words;
      all.insert(all.end(), {"--by", name});
      const auto refused = probebox(all);
      EXPECT_EQ(refused.status, 2) << name;
      EXPECT_THAT(refused.err, HasSubstr("person"));
    }
  }
  messages::ResultTransition forged;
  forged.utc = "2026-01-01T00:00:00Z";
  forged.by = "Ada\n2026-01-02T00:00:00Z  18 active by Bob";
  EXPECT_THAT(line(forged), testing::Not(HasSubstr("\n"))) << "a box that took it does not forge the page either";
}

TEST(CommandLine, GivesAnExampleInEveryHelp) {
  for (const std::string command :
       {"",       "list",     "info",    "status",      "watch",   "record", "export", "solve", "calibrate", "propose",
        "accept", "rollback", "history", "corrections", "results", "show",   "report", "home",  "inhibit",   "plan"}) {
    const auto answer = std::get<Answer>(parsed(command + " --help"));
    EXPECT_EQ(answer.status, ExitStatus::ok);
    EXPECT_THAT(answer.text, AllOf(HasSubstr("Example:\n  probebox "), HasSubstr(command)));
  }
}

// The list of live methods is the only place that names them.
TEST(Help, NamesEveryMethodThatCalibratesAndWhichOfThemTakeAnOption) {
  const std::string help = std::get<Answer>(parsed("calibrate --help")).text;
  for (const auto* method : procedure::liveMethods()) {
    if (method->calibrates) {
      EXPECT_THAT(help, HasSubstr(std::string{method->name()}));
    }
  }
  const MethodHelp methods = methodHelp();
  EXPECT_EQ(methods.heights, "c-axis-alignment and rotary-axis-errors");
  EXPECT_EQ(methods.angles, "centreline, centreline-limited-access, rotary-axis-errors, centreline-x and joint");
  EXPECT_EQ(methods.usual_arcs,
            "360 for centreline, rotary-axis-errors and centreline-x, 80 for centreline-limited-access and "
            "centreline-by-steps");
  EXPECT_EQ(methods.tool, "tool-setter and tool-assembly");
  EXPECT_EQ(methods.probe_tool, "pre-travel");
  EXPECT_EQ(methods.head, "rotary-axis-errors");
  EXPECT_EQ(methods.shank, "swivel-error and a-axis-alignment");
}

}  // namespace
}  // namespace probebox::command
