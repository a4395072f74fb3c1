#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <string>

#include "host-tests/support/file_content.hpp"
#include "on_the_machine.hpp"

// What a person is told about results in force: whose they are, what they rest on, and what they are about.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class WhatIsInForce : public OnTheMachine {
 protected:
  void acceptDelay() {
    const auto delay = box({"calibrate", "--speed", "20,40", "--accept", "--by", "Ada", "--although-it-differs"});
    ASSERT_EQ(delay.status, 0) << delay.err;
  }

  // A case about the length of tool 1.
  std::string assembledTool() {
    const auto folder = directory_.file("assembly");
    std::filesystem::create_directory(folder);
    std::ofstream{folder + "/config.json"}
        << R"({"method": "tool-assembly", "tool_id": 1, "L1_mm": 84, "L2_mm": 127, "part_mm": [0, 62, 25]})";
    std::ofstream{folder + "/readings.csv"} << "workpiece_variant,rep,W0_x_mm,W0_y_mm,L0_z_mm\n"
                                               "0,0,-0.0430,0.0466,129.0593\n0,1,-0.0433,0.0467,129.0551\n"
                                               "1,0,-0.0429,62.0501,154.0548\n1,1,-0.0457,62.0477,154.0567\n";
    return folder;
  }
};

TEST_F(WhatIsInForce, NamesWhatRestsOnADelayThatIsReplacedOrRolledBack) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  const auto axis = box({"calibrate", "centreline", "--angles", "3", "--accept", "--by", "Ada", "--json"});
  ASSERT_EQ(axis.status, 0) << axis.err;
  EXPECT_THAT(box({"show", "2"}).out, AllOf(HasSubstr("result 1"), HasSubstr("about delay")));
  const auto sentence = AllOf(HasSubstr("Result 2"), HasSubstr("centreline-stylus"), HasSubstr("result, 1"));
  const auto next = box({"calibrate", "--speed", "20,40", "--accept", "--by", "Bob", "--although-it-differs"});
  ASSERT_EQ(next.status, 0) << next.err;
  // Of two delays of one machine, which may agree within u: acceptance_test.cpp has both cases.
  EXPECT_EQ(next.out.find("rests on a retired") != std::string::npos,
            box({"status"}).out.find("rests on a retired") != std::string::npos);
  const auto back = box({"rollback", "delay", "--by", "Bob"});
  EXPECT_THAT(back.out, AllOf(HasSubstr("result 1"), HasSubstr("again"), Not(sentence)));
  EXPECT_THAT(box({"status"}).out, AllOf(HasSubstr("result 3"), HasSubstr("no longer"), Not(HasSubstr("waits"))))
      << "the last run";
  EXPECT_THAT(box({"rollback", "1", "--by", "Bob"}).out, sentence);
}

TEST_F(WhatIsInForce, IsNothingOfAStylusThatWasExchanged) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  start([](board::Descriptions& changed) { changed.probe.stylus = "long"; });
  const auto page = box({"results"}).out;
  EXPECT_THAT(page, AllOf(Not(HasSubstr("\nin force")), HasSubstr("force here"), HasSubstr("SIM-PROBE-1"),
                          HasSubstr("stylus long")));
  EXPECT_NE(page.rfind("in force\n", 0), 0U) << page;
  EXPECT_THAT(box({"show", "1"}).out, AllOf(HasSubstr("about delay:"), HasSubstr("force here")));
  EXPECT_THAT(box({"status"}).out, AllOf(HasSubstr("force   none"), HasSubstr("here  delay")));
  const auto object = box({"results", "--json"}).object();
  EXPECT_EQ(object["standing"], "not in force here");
  EXPECT_THAT(object["why_not_in_force"].get<std::string>(), HasSubstr("stylus long"));
  const auto refused = box({"rollback", "delay", "--by", "Ada"});
  EXPECT_THAT(refused.err, Not(HasSubstr("did you mean"))) << "the word was right";
  EXPECT_THAT(box({"rollback", "delya", "--by", "Ada"}).err, HasSubstr("did you mean delay?"));

  // One that cannot be accepted is not held beside what is in force first.
  const auto again = box({"accept", "1", "--by", "Ada"});
  EXPECT_EQ(again.status, 4);
  EXPECT_EQ(again.out, "");
}

TEST_F(WhatIsInForce, IsOneQuantityASubject) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  const auto run = box({"calibrate", "spindle-offset-2x2"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto accepted = box({"accept", "3", "--by", "Ada"});
  ASSERT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_THAT(accepted.out, AllOf(HasSubstr("offset X"), Not(HasSubstr("offset C minus A"))));
  EXPECT_THAT(box({"results", "stylus-offset-1"}).out,
              AllOf(HasSubstr("offset X"), Not(HasSubstr("offset C minus A"))));
  EXPECT_THAT(box({"status"}).out, HasSubstr("3     active    stylus-offset-1  stylus offset X"));
  const auto shown = box({"show", "3"}).out;
  EXPECT_LT(shown.find("stylus offset X"), shown.find("from the same readings"));
  EXPECT_GT(shown.find("offset C minus A X"), shown.find("from the same readings"));
  EXPECT_THAT(shown, AllOf(HasSubstr("4 degrees"), HasSubstr("99.9 %")));
}

// The box adds the two, and keeps the data of either.
TEST_F(WhatIsInForce, IsASumOfTwoResultsWithoutDataOfItsOwn) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"centreline", "--angles", "3"}, {"spindle-offset-2x2"}, {"spindle-offset-2x2"}}) {
    auto run = words;
    run.insert(run.begin(), "calibrate");
    ASSERT_EQ(box(run).status, 0);
  }
  ASSERT_EQ(box({"accept", "2", "--by", "Ada"}).status, 0);
  ASSERT_THAT(box({"accept", "4", "--by", "Ada"}).out, HasSubstr("Result 7"));
  ASSERT_THAT(box({"accept", "6", "--by", "Ada"}).out, HasSubstr("Result 8"));
  EXPECT_THAT(box({"show", "8"}).out, HasSubstr("the sum"));
  const auto accepted = box({"accept", "8", "--by", "Ada"});
  EXPECT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_THAT(accepted.err, Not(HasSubstr("does not keep")));
  const auto certificate = directory_.file("sum.html");
  EXPECT_EQ(box({"certificate", "8", "-o", certificate}).status, 0);
}

TEST_F(WhatIsInForce, IsTheStylusOfEveryToolByItself) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  const auto run = box({"calibrate", "a-axis-alignment"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto accepted = box({"accept", "4", "--by", "Ada"});
  ASSERT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_THAT(accepted.out, AllOf(HasSubstr("stylus-offset-2"), HasSubstr("offset X"), Not(HasSubstr("tilt"))));
  EXPECT_THAT(box({"results", "stylus-offset-2"}).out,
              AllOf(HasSubstr("offset X"), Not(HasSubstr("stylus offset of tool"))));
  const auto shown = box({"show", "4"}).out;
  EXPECT_GT(shown.find("stylus offset of tool 1 X"), shown.find("from the same readings")) << shown;
  EXPECT_EQ(shown.find("stylus offset of tool 2"), std::string::npos) << shown;
  EXPECT_THAT(box({"results", "stylus-offset-1"}).out, HasSubstr("proposed"));
}

// A stylus hangs where it does however long its tool is.
TEST_F(WhatIsInForce, IsNoStylusThatRestsOnALengthOfATool) {
  ASSERT_NO_FATAL_FAILURE(acceptDelay());
  const auto saved = directory_.file("alignment");
  const auto run = box({"calibrate", "a-axis-alignment", "--save", saved});
  ASSERT_EQ(run.status, 0) << run.err;
  auto config = support::contentOf(saved + "/config.json");
  ASSERT_TRUE(config.starts_with("{"));
  const auto nameLength = [&](const std::string& result) {
    std::ofstream{saved + "/config.json"} << std::string{config}.insert(1, "\"length_1_result\": " + result + ", ");
  };
  nameLength("2");
  EXPECT_THAT(box({"propose", saved}).err, AllOf(HasSubstr("unknown-result: "), HasSubstr("result 2"),
                                                 HasSubstr("length_1_result"), HasSubstr("spindle-tilt")));
  const auto assembly = box({"propose", assembledTool(), "--as-this-machine", "--by", "Ada"});
  ASSERT_EQ(assembly.status, 0) << assembly.err;
  nameLength("5");
  const auto proposed = box({"propose", saved});
  ASSERT_EQ(proposed.status, 0) << proposed.err;
  const auto on_length = AllOf(HasSubstr("result 5"), HasSubstr("assembly-1"));
  const auto on_delay = HasSubstr("result 1");
  EXPECT_THAT(box({"show", "6"}).out, AllOf(HasSubstr("about spindle-tilt"), on_length, on_delay));
  EXPECT_THAT(box({"show", "7"}).out, AllOf(HasSubstr("about stylus-offset-1"), Not(on_length), on_delay));
}

}  // namespace
}  // namespace probebox::command
