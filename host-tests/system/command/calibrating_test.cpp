#include <chrono>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "fake_answers.hpp"
#include "fake_box.hpp"
#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

const std::vector<std::string> kCalibrate{"calibrate", "delay-multi-speed"};

Finished at(const FakeBox& box, std::vector<std::string> arguments, const std::atomic<bool>* interrupted = nullptr) {
  arguments.insert(arguments.begin(), {"-u", box.uri()});
  return probebox(arguments, {}, interrupted);
}

TEST(Calibrating, LeadsThroughTheStepsToAResultWithItsUncertainty) {
  const FakeBox box;
  const auto done = at(box, kCalibrate);
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("touch 1"), HasSubstr("3: +X"), HasSubstr("touch 3"),
                              HasSubstr("delay 5447.1 +/- 5.0 us"), HasSubstr("proposed")));
  EXPECT_THAT(done.err, HasSubstr("probebox accept 4711 --by NAME")) << "a proposal is not in force";
}

// Without a controller a person's Enter begins a step, and ends it.
TEST(Calibrating, IsLedByHand) {
  const FakeBox box{{.by_hand = true}};
  unsigned pressed = 0;
  const auto press = [&] { return ++pressed, true; };
  const auto done = probebox({"-u", box.uri(), "calibrate", "delay-multi-speed"}, {}, nullptr, press);
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_GE(pressed, 6U) << "begin and end of three steps";
  EXPECT_THAT(done.err, HasSubstr("press Enter"));
  EXPECT_THAT(done.out, HasSubstr("proposed"));
}

TEST(Calibrating, SpeaksInObjectsToPrograms) {
  const FakeBox box;
  const auto objects = at(box, {"calibrate", "delay-multi-speed", "--json"}).objects();
  EXPECT_EQ(objects.front()["state"], "waiting");
  EXPECT_EQ(objects.back()["result"]["tau_s"], FakeBox::kTau_s);
  EXPECT_EQ(objects.back()["sd"]["tau_s"], FakeBox::kSd_s);
  for (const auto& object : objects) EXPECT_EQ(object["schema_version"], 1);
}

TEST(Calibrating, AcceptsOnlyWhenTold) {
  const FakeBox box;
  at(box, kCalibrate);
  EXPECT_EQ(at(box, {"status", "--json"}).object()["active_result_ids"].size(), 0U);
  const auto done = at(box, {"calibrate", "delay-multi-speed", "--accept", "--by", "Ada"});
  EXPECT_THAT(done.out, AllOf(HasSubstr("in force"), HasSubstr("Ada")));
  EXPECT_EQ(at(box, {"status", "--json"}).object()["active_result_ids"][0], FakeBox::kResultId);
}

TEST(Calibrating, SavesExactlyWhatTheBoxMeasured) {
  const RuntimeDirectory directory;
  const FakeBox box;
  const auto folder = directory.file("case");
  const auto done = at(box, {"calibrate", "delay-multi-speed", "--save", folder});
  EXPECT_EQ(done.status, 0) << done.err;
  const auto saved = casefolder::readCase(folder);
  ASSERT_TRUE(saved);
  const auto measured = fakeDataset();
  EXPECT_EQ(saved->method, measured.method);
  EXPECT_EQ(saved->config, measured.config);
  ASSERT_EQ(saved->tables.size(), measured.tables.size());
  for (const auto& table : measured.tables) EXPECT_EQ(*saved->table(table.name), table);

  const auto again = at(box, {"calibrate", "delay-multi-speed", "--save", folder});
  EXPECT_EQ(again.status, 2) << "said before the machine moves";
  EXPECT_THAT(again.err, HasSubstr(folder));
}

TEST(Calibrating, MovesNothingWhereItCouldNotSave) {
  const RuntimeDirectory directory;
  std::filesystem::create_directory(directory.file("mine"));
  std::ofstream{directory.file("mine/machine.csv")} << "precious";
  const FakeBox box;
  for (const std::string& folder :
       {std::string{"/proc/x"}, directory.file(std::string(300, 'a')), directory.file("mine")}) {
    const auto done = at(box, {"calibrate", "delay-multi-speed", "--save", folder});
    EXPECT_EQ(done.status, 2);
    EXPECT_THAT(done.err, AllOf(HasSubstr("--save " + folder), HasSubstr("another folder")));
  }
  EXPECT_FALSE(box.calibrating());
  EXPECT_EQ(support::contentOf(directory.file("mine/machine.csv")), "precious");
}

TEST(Calibrating, SaysWhatTheBoxKeepsWhereTheFolderIsTakenMeanwhile) {
  const RuntimeDirectory directory;
  const auto folder = directory.file("case");
  const auto take = [&] {
    std::filesystem::create_directory(folder);
    std::ofstream{folder + "/machine.csv"} << "precious";
  };
  const FakeBox box{{.when_asked = take}};
  const auto done = at(box, {"calibrate", "delay-multi-speed", "--save", folder});
  EXPECT_EQ(done.status, 2);
  EXPECT_THAT(done.err, AllOf(HasSubstr("machine.csv"), HasSubstr("probebox report 4711 -o")));
  EXPECT_EQ(support::contentOf(folder + "/machine.csv"), "precious");
}

TEST(Calibrating, TellsARefusalWithItsRemedyAndStillSaves) {
  const RuntimeDirectory directory;
  const FakeBox box{{.refuses_run = true}};
  const auto folder = directory.file("case");
  const auto done = at(box, {"calibrate", "delay-multi-speed", "--accept", "--by", "Ada", "--save", folder});
  EXPECT_EQ(done.status, 1);
  EXPECT_THAT(done.err, HasSubstr("single-speed: "));
  EXPECT_TRUE(casefolder::readCase(folder));
}

TEST(Calibrating, GoesOnAfterALostLink) {
  FakeBox box;
  std::jthread cutter{[&box] {
    while (!box.calibrating()) std::this_thread::sleep_for(5ms);
    std::this_thread::sleep_for(300ms);
    box.cut();
  }};
  const auto done = at(box, kCalibrate);
  EXPECT_EQ(done.status, 0) << done.err;
}

TEST(Calibrating, StopsTheMachineAtCtrlC) {
  const FakeBox box;
  std::atomic<bool> interrupted{false};
  std::jthread person{[&] {
    while (!box.calibrating()) std::this_thread::sleep_for(5ms);
    interrupted = true;
  }};
  const auto done = at(box, kCalibrate, &interrupted);
  EXPECT_EQ(done.status, 130);
  EXPECT_THAT(done.err, HasSubstr("aborted"));
}

// What somebody else does on the machine is not stopped by a command that began nothing, or whose run is gone.
TEST(Calibrating, LeavesTheRunsOfOthersAlone) {
  for (const bool busy : {true, false}) {
    std::atomic<bool> interrupted{false};
    const FakeBox box{{.busy = busy, .at_another_run = !busy, .when_asked = [&] { interrupted = true; }}};
    const auto done = at(box, kCalibrate, &interrupted);
    EXPECT_NE(done.status, 0);
    EXPECT_TRUE(box.calibrating()) << done.err;
    EXPECT_THAT(done.err, testing::Not(HasSubstr("aborted")));
  }
}

TEST(Calibrating, StopsTheMachineWhenNobodyReadsTheStepsAnyMore) {
  const FakeBox box;
  const auto ended = probeboxInto(20, {"-u", box.uri(), "calibrate"});
  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.err, HasSubstr("aborted"));
  EXPECT_FALSE(box.calibrating());
}

TEST(Calibrating, EndsARunWhoseCommandWasKilled) {
  const FakeBox box;
  const auto done = at(box, {"calibrate", "--abort"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("no calibration"));
}

TEST(Calibrating, PassesOnWhatTheBoxRefuses) {
  const FakeBox busy{{.busy = true}};
  const auto done = at(busy, {"calibrate", "delay-multi-speed", "--json"});
  EXPECT_EQ(done.status, 4);
  EXPECT_THAT(done.err, HasSubstr("run 6"));
  EXPECT_EQ(done.object()["error"], "busy");
}

TEST(Accepting, PutsAProposedResultIntoForce) {
  const FakeBox box;
  const auto done = at(box, {"accept", "4711", "--by", "Ada"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("Ada"));
  const auto again = at(box, {"accept", "4711", "--by", "Zed"});
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(again.out, AllOf(HasSubstr("in force"), HasSubstr("Ada"), HasSubstr("nothing")));
  EXPECT_EQ(at(box, {"accept", "4711", "--by", "Zed", "--json"}).object()["accepted_by"], "Ada");
}

TEST(Accepting, PassesOnWhatTheBoxRefuses) {
  const FakeBox strict{{.forbids_accepting = true}};
  const auto forbidden = at(strict, {"accept", "4711", "--by", "Ada"});
  EXPECT_EQ(forbidden.status, 4);
  EXPECT_THAT(forbidden.err, HasSubstr("service.toml"));
  const FakeBox box;
  EXPECT_EQ(at(box, {"accept", "12", "--by", "Ada"}).status, 4);
}

TEST(Accepting, SaysWhenTheResultHasToWaitForTheEndOfACut) {
  const FakeBox cutting{{.cut_is_on = true}};
  const auto done = at(cutting, {"accept", "4711", "--by", "Ada"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("the cut"), testing::Not(HasSubstr("is in force"))));
  const auto object = at(cutting, {"accept", "4711", "--by", "Ada", "--json"}).object();
  EXPECT_EQ(object["state"], "accepted");
  EXPECT_EQ(object["waiting_for_cut"], true);
}

TEST(Accepting, ShowsTheResultBesideTheOneInForce) {
  const FakeBox first;
  EXPECT_THAT(at(first, {"accept", "4711", "--by", "Ada"}).out, HasSubstr("first of"));

  // 7 us, where each is known to 5 us.
  const FakeBox near{{.in_force_tau_s = FakeBox::kTau_s - 7e-6}};
  const auto done = at(near, {"accept", "4711", "--by", "Ada"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("4710"), HasSubstr("5447.1 us, sd 5.0 us, U 20 us"),
                              HasSubstr("5440.1 us, sd 5.0 us, U 20 us"), HasSubstr("+7.0 us, 1.0 sd")));
}

TEST(Accepting, WantsAWordForWhatDiffersByMoreThanFourSd) {
  const FakeBox box{{.in_force_tau_s = FakeBox::kTau_s - 30e-6}};
  const auto refused = at(box, {"accept", "4711", "--by", "Ada", "--json"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_EQ(refused.objects().at(1)["error"], "differs");
  EXPECT_THAT(refused.err, AllOf(HasSubstr("4.2 sd"), HasSubstr("--although-it-differs")));
  const auto comparison = refused.objects().at(0)["comparison"];
  EXPECT_EQ(comparison["in_force_id"], 4710);
  EXPECT_NEAR(comparison["values"]["tau_s"]["difference"].get<double>(), 30e-6, 1e-12);
  EXPECT_EQ(at(box, {"status", "--json"}).object()["active_result_ids"].dump(), "[4710]") << "nothing was accepted";

  const auto meant = at(box, {"accept", "4711", "--by", "Ada", "--although-it-differs"});
  EXPECT_EQ(meant.status, 0) << meant.err;
  EXPECT_THAT(meant.out, AllOf(HasSubstr("in force"), HasSubstr("Ada")));
  const FakeBox again{{.in_force_tau_s = FakeBox::kTau_s - 30e-6}};
  EXPECT_EQ(at(again, {"calibrate", "delay-multi-speed", "--accept", "--by", "Ada"}).status, 1);
  EXPECT_EQ(at(again, {"calibrate", "delay-multi-speed", "--accept", "--by", "Ada", "--although-it-differs"}).status,
            0);
}

TEST(Accepting, AsksThePersonAtATerminal) {
  const auto answered = [](const std::string& answer) {
    const FakeBox box{{.in_force_tau_s = FakeBox::kTau_s - 30e-6}};
    return probebox({"-u", box.uri(), "accept", "4711", "--by", "Ada"}, answer, nullptr, [] { return false; });
  };
  EXPECT_EQ(answered("y\n").status, 0);
  for (const std::string answer : {"", "\n", "n\n", "maybe\n"}) {
    const auto no = answered(answer);
    EXPECT_EQ(no.status, 1) << answer;
    EXPECT_THAT(no.err, HasSubstr("[y/N]"));
  }
}

TEST(StoredResults, AreFetchedPieceByPieceAndReported) {
  const FakeBox box{{.in_force_tau_s = FakeBox::kTau_s}};
  EXPECT_THAT(at(box, {"show", "4711"}).out,
              AllOf(HasSubstr("delay "), HasSubstr("sd 5.0 us, U 20 us"), HasSubstr("result 4700"),
                    HasSubstr("stylus-offset-1"), HasSubstr("RETIRED"), HasSubstr("Hopper")));
  EXPECT_THAT(at(box, {"results"}).out, AllOf(HasSubstr("result 4700"), HasSubstr("retired")));
  RuntimeDirectory directory;
  const auto lost = at(box, {"report", "delay", "-o", directory.file("a.html")});
  EXPECT_EQ(lost.status, 1);
  EXPECT_THAT(lost.err, AllOf(HasSubstr("result 4710"), HasSubstr("measure again")));
  const auto kept = at(box, {"report", "4711", "-o", directory.file("b.html")});
  EXPECT_EQ(kept.status, 0) << kept.err;
  EXPECT_THAT(support::contentOf(directory.file("b.html")),
              AllOf(HasSubstr("4700"), HasSubstr("stylus-offset-1"), HasSubstr("RETIRED")));
  EXPECT_EQ(at(box, {"report", "17", "-o", directory.file("c.html")}).status, 4);
}

TEST(StoredResults, AreReportedAfterARefusedRunAboutTheSame) {
  const FakeBox box{{.in_force_tau_s = FakeBox::kTau_s, .refused_before = true}};
  RuntimeDirectory directory;
  const auto kept = at(box, {"report", "4711", "-o", directory.file("page.html")});
  EXPECT_EQ(kept.status, 0) << kept.err;
}

TEST(GoingBack, NamesTheSubjectThatWasMeant) {
  const FakeBox box{{.in_force_tau_s = FakeBox::kTau_s}};
  EXPECT_THAT(at(box, {"rollback", "dealy", "--by", "Ada"}).err, HasSubstr("delay?"));
  EXPECT_THAT(at(box, {"history", "dealy"}).err, HasSubstr("delay?"));
  EXPECT_THAT(at(box, {"results", "dealy"}).err, HasSubstr("delay?"));
}

TEST(Calibrating, NamesTheMethodThatWasMeant) {
  for (const auto& words : {std::vector<std::string>{"plan", "delay-mutli-speed"},
                            std::vector<std::string>{"solve", "--methods", "delay-mutli-speed"}})
    EXPECT_THAT(probebox(words).err, HasSubstr("delay-multi-speed?"));
}

TEST(GoingBack, NamesWhatGoesAndWhatComesBack) {
  const FakeBox box;
  for (const auto* what : {"delay", "4711"}) {
    const auto done = at(box, {"rollback", what, "--by", "Grace"});
    EXPECT_EQ(done.status, 0) << done.err;
    EXPECT_THAT(done.out, AllOf(HasSubstr("4711"), HasSubstr("Grace"), HasSubstr("4710"), HasSubstr("again")));
  }
  const auto object = at(box, {"rollback", "delay", "--by", "Grace", "--json"}).object();
  EXPECT_EQ(object["schema_version"], 1);
  EXPECT_EQ(object["retired_id"], 4711);
  EXPECT_EQ(object["active_id"], 4710);
}

TEST(GoingBack, PassesOnWhatTheBoxRefuses) {
  const FakeBox box;
  const auto unknown = at(box, {"rollback", "swivel", "--by", "Grace", "--json"});
  EXPECT_EQ(unknown.status, 4);
  EXPECT_EQ(unknown.object()["error"], "wrong_state");
  EXPECT_THAT(unknown.err, HasSubstr("'swivel'"));
  const FakeBox cutting{{.cut_is_on = true}};
  EXPECT_EQ(at(cutting, {"rollback", "delay", "--by", "Grace"}).status, 4);
}

TEST(LookingBack, TellsEveryTransitionWithWhoAndWhen) {
  const FakeBox box;
  const auto objects = at(box, {"history", "--json"}).objects();
  ASSERT_EQ(objects.size(), 20U) << "over as many answers as it takes";
  for (std::size_t i = 0; i < objects.size(); ++i) EXPECT_EQ(objects[i]["number"], i + 1);
  EXPECT_EQ(objects[1]["by"], "Ada");
  EXPECT_EQ(objects[1]["utc"], "2026-11-21T06:00:00Z");
  EXPECT_EQ(objects[1]["state"], "active");

  EXPECT_EQ(at(box, {"history", "7", "--json"}).objects().size(), 2U);
  EXPECT_THAT(at(box, {"history", "7"}).out, AllOf(HasSubstr("proposed"), HasSubstr("active"), HasSubstr("by Ada")));
  const auto nothing = at(box, {"history", "swivel"});
  EXPECT_EQ(nothing.status, 1);
  EXPECT_THAT(nothing.err, HasSubstr("swivel"));
}

}  // namespace
}  // namespace probebox::command
