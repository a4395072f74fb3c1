#include <atomic>
#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>
#include <thread>
#include <unistd.h>

#include "drivers/io/rendezvous.hpp"
#include "fake_answers.hpp"
#include "fake_box.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/probebox/link/stored_results.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Looking : public testing::Test {
 protected:
  RuntimeDirectory directory_;
  FakeBox box_;
  std::string uri_ = box_.uri();
};

TEST_F(Looking, SaysWhichCellOfAViewCannotBeRead) {
  const auto done = probebox({"-u", uri_, "view", "--cell", directory_.path().string()});
  EXPECT_EQ(done.status, 2);
  EXPECT_THAT(done.err, testing::AnyOf(HasSubstr("folder)"), HasSubstr("page")));
}

TEST_F(Looking, StatusIsAPageForPeopleAndAnObjectForPrograms) {
  const auto page = probebox({"-u", uri_, "status"});
  EXPECT_EQ(page.status, 0) << page.err;
  EXPECT_THAT(page.out, AllOf(HasSubstr("locked"), HasSubstr("850 ns"), HasSubstr("125000"), HasSubstr("150"),
                              HasSubstr("125000 edges"), HasSubstr("3 lost"), HasSubstr("620 ns"), HasSubstr("+41.000"),
                              HasSubstr("250000"), HasSubstr("12 missing"), HasSubstr("900"), HasSubstr("5 bad"),
                              HasSubstr("gpiochip0 line"), HasSubstr("'spindle'")));
  EXPECT_THAT(page.out, Not(testing::ContainsRegex("nothing from +gpiochip0 line 4"))) << "it has no problem";
  EXPECT_THAT(page.out,
              AllOf(HasSubstr("700000"), HasSubstr("40 lost"), HasSubstr("30 found"), HasSubstr("6 late"),
                    HasSubstr("7 overwritten"), HasSubstr("8 rows"), HasSubstr("9 stray"), HasSubstr("11 events"),
                    HasSubstr("gpiochip0 line"), HasSubstr("5 messages"), HasSubstr("2 times"), HasSubstr("/dev/ttyS2"),
                    HasSubstr("500"), HasSubstr("12 refused"), HasSubstr("13 bad"), HasSubstr("14 bytes"),
                    HasSubstr("15 answers"), HasSubstr("16 times")));
  EXPECT_THAT(page.out, AllOf(HasSubstr("21 connections"), HasSubstr("22 times"), HasSubstr("24 failed"),
                              HasSubstr("23 bytes"), HasSubstr("/run/x")));
  EXPECT_THAT(page.err, IsEmpty());

  const auto status = probebox({"-u", uri_, "status", "--json"}).object();
  EXPECT_EQ(status["schema_version"], 1);
  EXPECT_EQ(status["clock"]["state"], "locked");
  EXPECT_EQ(status["clock"]["sigma_ns"], 850);
  EXPECT_EQ(status["receiver"]["missing_samples"], 12);
  EXPECT_EQ(status["receiver"]["unstamped_samples"], 900);
  EXPECT_EQ(status["receiver"]["bad_packets"], 5);
  EXPECT_EQ(status["ledger"]["lost_at_source_samples"], 150);
  EXPECT_EQ(status["lines"][0]["role"], "sync");
  EXPECT_EQ(status["lines"][0]["lost_edges"], 3);
  EXPECT_EQ(status["sources"][0]["problem"], "");
  EXPECT_EQ(status["sources"][0]["unusable_messages"], 5);
  EXPECT_EQ(status["events"]["lost_in_queue_events"], 30);
  EXPECT_EQ(status["events"]["late_events"], 6);
  EXPECT_EQ(status["events"]["disordered_events"], 0);
  EXPECT_EQ(status["events"]["overwritten_events"], 7);
  EXPECT_EQ(status["events"]["incomplete_rows"], 8);
  EXPECT_EQ(status["events"]["stray_markers"], 9);
  EXPECT_EQ(status["events"]["lost_journal_events"], 11);
  EXPECT_EQ(status["events"]["sources_gone"], 2);
  EXPECT_EQ(status["cnc_lines"][0]["name"], "/dev/ttyS2");
  EXPECT_EQ(status["cnc_lines"][0]["unsent_answers"], 15);
  EXPECT_EQ(status["cnc_lines"][0]["reopened"], 16);
  EXPECT_EQ(status["usb_ports"][0]["stalled_requests"], 25);
  EXPECT_EQ(status["sources"][1]["problem"], "held by 'spindle'; stop that");
}

TEST_F(Looking, InfoNamesBoxMachineAndChannels) {
  const auto page = probebox({"-u", uri_, "info"});
  EXPECT_EQ(page.status, 0) << page.err;
  EXPECT_THAT(page.out,
              AllOf(HasSubstr("F-0001"), HasSubstr("test mill"), HasSubstr("deflection_a"), HasSubstr("1000")));
  const auto info = probebox({"-u", uri_, "info", "--json"}).object();
  EXPECT_EQ(info["channels"][1]["name"], "x");
  EXPECT_EQ(info["nominal_tick_period_ns"], 1'000'000);
}

TEST_F(Looking, WatchPrintsOneObjectForEachUpdateAndStopsByItself) {
  const auto watched = probebox({"-u", uri_, "watch", "--json", "--count", "3"});
  EXPECT_EQ(watched.status, 0) << watched.err;
  const auto objects = watched.objects();
  ASSERT_EQ(objects.size(), 3U);
  for (const auto& object : objects) {
    EXPECT_EQ(object["clock"]["state"], "locked");
    EXPECT_TRUE(object["ledger"]["balanced"]);
  }
  EXPECT_GT(objects[2]["ledger"]["produced_samples"], objects[0]["ledger"]["produced_samples"]);
  // Channel x counts thousandths of a micrometre, and sample k stands at count 1000 k.
  EXPECT_EQ(objects[2]["values"]["x_um"].get<double>(), objects[2]["sample"].get<double>());
}

TEST_F(Looking, WatchTakesATimeLongerThanALife) {
  EXPECT_EQ(probebox({"-u", box_.uri(), "watch", "--json", "--for", "1e12", "--count", "2"}).objects().size(), 2U);
}

TEST_F(Looking, WatchShowsLinesWithoutATerminal) {
  const auto watched = probebox({"-u", uri_, "watch", "--for", "0.5"});
  EXPECT_EQ(watched.status, 0) << watched.err;
  EXPECT_THAT(watched.out, AllOf(HasSubstr("850 ns"), testing::ContainsRegex("a -[0-9]+ nm  x [0-9]+.[0-9]+ um"),
                                 testing::ContainsRegex("samples [0-9]+ = [0-9]+ received \\+ [0-9]+ lost")));
  std::istringstream lines{watched.out};
  for (std::string line; std::getline(lines, line);) EXPECT_THAT(line, HasSubstr(" um")) << "values from the first on";
  EXPECT_THAT(watched.out, testing::Not(HasSubstr("\x1b"))) << "nothing is drawn where there is no terminal";
}

TEST_F(Looking, WatchOutlivesALostLinkAndKeepsTheAccount) {
  FakeBox box{{.loses_at_source = false}};
  const std::jthread cable{[&box](const std::stop_token& stop) {
    while (!stop.stop_requested() && !box.streaming()) std::this_thread::sleep_for(5ms);
    std::this_thread::sleep_for(300ms);  // some samples
    box.cut();
  }};
  const auto watched = probebox({"-u", box.uri(), "watch", "--json", "--for", "2"});
  EXPECT_EQ(watched.status, 0) << watched.err;
  std::vector<std::string> events;
  for (const auto& object : watched.objects()) {
    if (object.contains("event")) {
      events.push_back(object["event"]);
      continue;
    }
    EXPECT_TRUE(object["ledger"]["balanced"]);
    EXPECT_EQ(object["ledger"]["produced_samples"], object["ledger"]["received_samples"]);
  }
  EXPECT_THAT(events, testing::ElementsAre("link-lost", "link-restored"));
  EXPECT_EQ(watched.objects().back()["reconnections"], 1);
}

TEST_F(Looking, CorrectionsOnceOrAsTheyCome) {
  const auto once = probebox({"-u", uri_, "corrections"});
  EXPECT_EQ(once.status, 0) << once.err;
  EXPECT_THAT(once.out, AllOf(HasSubstr("X +0.0012"), HasSubstr("centreline"), HasSubstr("not calibrated")));
  const auto followed = probebox({"-u", uri_, "corrections", "--follow", "--count", "2", "--json"}).objects();
  ASSERT_EQ(followed.size(), 2U);
  EXPECT_EQ(followed[0]["correction_mm"][1], -0.0034);
}

TEST_F(Looking, EndsWhenNobodyReadsItsAnswersAnyMore) {
  for (const std::vector<std::string>& endless :
       {std::vector<std::string>{"watch"}, {"watch", "--json"}, {"corrections", "--follow"}}) {
    std::vector<std::string> arguments{"-u", uri_};
    arguments.insert(arguments.end(), endless.begin(), endless.end());
    const auto ended = probeboxInto(300, arguments);
    EXPECT_EQ(ended.status, 2) << endless.front();
    EXPECT_THAT(ended.err, HasSubstr("standard output"));
  }
}

TEST_F(Looking, FailsWhenItsAnswerCannotBeWritten) {
  for (const auto* command : {"status", "info", "list", "corrections"}) {
    const auto failed = probeboxInto(10, {"-u", uri_, command});
    EXPECT_EQ(failed.status, 2) << command;
    EXPECT_THAT(failed.err, HasSubstr("standard output")) << command;
    EXPECT_EQ(probeboxInto(100'000, {"-u", uri_, command}).status, 0) << command;
  }
  EXPECT_EQ(probeboxInto(10, {"--help"}).status, 2);
}

TEST_F(Looking, StatusListsTheStoredResults) {
  const auto page = probebox({"-u", uri_, "status"});
  EXPECT_THAT(page.out, testing::ContainsRegex("4711 +proposed +delay +delay 5447.1 \\+/- 5.0 us"));
  EXPECT_THAT(page.out, testing::Not(HasSubstr("\n\n"))) << "a box that names no values in use";
  const auto results = probebox({"-u", uri_, "status", "--json"}).object()["newest_results"];
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0]["id"], FakeBox::kResultId);
  EXPECT_EQ(results[0]["state"], "proposed");
}

// One meaning in every text: type B is in it, and programs find both.
TEST(LookingAtResults, ShowsTheCombinedUncertaintyBehindPlusMinus) {
  const FakeBox box{{.u_s = 8e-6}};
  for (const auto* command : {"status", "results"})
    EXPECT_THAT(probebox({"-u", box.uri(), command}).out, testing::ContainsRegex("delay +5447.1 \\+/- 8.0 us"))
        << command;
  const auto object = probebox({"-u", box.uri(), "results", "--json"}).object();
  EXPECT_EQ(object["sd"]["tau_s"], FakeBox::kSd_s);
  EXPECT_EQ(object["u"]["tau_s"], 8e-6);
  const FakeBox old;
  EXPECT_THAT(probebox({"-u", old.uri(), "results"}).out, testing::ContainsRegex("delay +5447.1 \\+/- 5.0 us"));
  EXPECT_TRUE(probebox({"-u", old.uri(), "results", "--json"}).object()["u"]["tau_s"].is_null());
}

TEST_F(Looking, StatusListsTheNewestOfManyResults) {
  const FakeBox box{{.older_results = 23}};
  const auto results = probebox({"-u", box.uri(), "status", "--json"}).object()["newest_results"];
  ASSERT_EQ(results.size(), 5U);
  EXPECT_EQ(results[4]["id"], FakeBox::kResultId);
  EXPECT_EQ(results[3]["id"], 23);
  EXPECT_EQ(results[0]["id"], 20);
}

// A backup that holds the file for a while is no reason to say nothing about the box.
TEST_F(Looking, StatusIsToldThoughTheStoreIsLocked) {
  FakeBoxOptions locked;
  locked.answers_first = [](messages::Operation operation, std::span<const std::byte>) {
    std::optional<FakeAnswers::Reply> reply;
    if (operation == messages::Operation::list_results)
      reply = {messages::ErrorCode::wrong_state, "results.db is locked by another process", {}};
    return reply;
  };
  const FakeBox box{locked};
  const auto page = probebox({"-u", box.uri(), "status"});
  EXPECT_EQ(page.status, 0);
  EXPECT_THAT(page.out, HasSubstr("results.db"));
  const auto object = probebox({"-u", box.uri(), "status", "--json"}).object();
  EXPECT_TRUE(object["newest_results"].is_null());
  EXPECT_THAT(object["storage_problems"].dump(), HasSubstr("is locked"));
}

TEST_F(Looking, EndsWhereTheHistoryOfABoxDoesNot) {
  const FakeBox box{{.endless = true}};
  const auto ended = probebox({"-u", box.uri(), "history", "--json"});
  EXPECT_EQ(ended.status, 3);
  EXPECT_THAT(ended.err, HasSubstr("number 7"));
  EXPECT_EQ(probebox({"-u", box.uri(), "status"}).status, 0) << "it asks for the newest only";
}

// Each answer has one more result, and announces others: nobody waits for the last one.
TEST_F(Looking, EndsWhereTheResultsOfABoxDoNot) {
  FakeBoxOptions growing;
  growing.answers_first = [](messages::Operation operation, std::span<const std::byte> body) {
    std::optional<FakeAnswers::Reply> reply;
    if (operation != messages::Operation::list_results) return reply;
    messages::ListResults::Answer list;
    list.results.push_back({.id = messages::decode<messages::ListResults::Request>(body)->after_id + 1});
    list.more = true;
    reply = {messages::ErrorCode::ok, {}, messages::encoded(list)};
    return reply;
  };
  const FakeBox box{growing};
  const std::atomic<bool> never{false};
  std::istringstream in;
  std::ostringstream out;
  Console console{{in, out, out, false, false, 0, never}, false};
  auto link = openBox(box.uri(), console);
  ASSERT_TRUE(link);
  const auto all = storedResults(**link, console, {}, std::numeric_limits<std::size_t>::max(), 20);
  ASSERT_FALSE(all);
  EXPECT_THAT(all.error().what, HasSubstr("number 21"));
}

TEST_F(Looking, ListFindsAnnouncedBoxesAndPassesOverDeadOnes) {
  ASSERT_TRUE(io::rendezvous::announce(::getpid(), {uri_, "tcp:127.0.0.1:1"}));
  const auto table = probebox({"list"});
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr(uri_), HasSubstr("F-0001"), HasSubstr("test mill"), HasSubstr("locked")));
  EXPECT_THAT(table.out, testing::Not(HasSubstr("tcp:127.0.0.1:1 ")));
  const auto boxes = probebox({"list", "--json"}).object()["boxes"];
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0]["uri"], uri_);
  EXPECT_EQ(boxes[0]["clock_state"], "locked");
}

TEST_F(Looking, TakesTheOnlyAnnouncedBoxThatIsThere) {
  ASSERT_TRUE(io::rendezvous::announce(::getpid(), {uri_}));
  ASSERT_TRUE(io::rendezvous::announce(1, {"tcp:127.0.0.1:2"})) << "left behind by a killed box";
  EXPECT_THAT(probebox({"info"}).out, HasSubstr("F-0001"));
}

TEST_F(Looking, AsksWhichOfSeveralBoxesIsMeant) {
  ASSERT_TRUE(io::rendezvous::announce(::getpid(), {uri_}));
  const FakeBox other;
  ASSERT_TRUE(io::rendezvous::announce(1, {other.uri()}));
  const auto refused = probebox({"info"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("-u"), HasSubstr(uri_), HasSubstr(other.uri())));
}

TEST_F(Looking, TakesTheUriFromTheEnvironment) {
  ::setenv("PROBEBOX_URI", uri_.c_str(), 1);
  const auto status = probebox({"status"});
  ::unsetenv("PROBEBOX_URI");
  EXPECT_EQ(status.status, 0) << status.err;
}

TEST(LookingWithoutABox, SaysHowToStartOne) {
  const RuntimeDirectory directory;
  for (const auto* command : {"status", "info", "watch", "corrections"}) {
    const auto failed = probebox({"-u", "tcp:127.0.0.1:1", command, "--json"});
    EXPECT_EQ(failed.status, 3) << command;
    EXPECT_THAT(failed.err, HasSubstr("probeboxd --board sim"));
    EXPECT_EQ(failed.object()["error"], "no-box");
    EXPECT_EQ(failed.object()["exit_status"], 3);
  }
}

TEST(LookingWithoutABox, InAChosenRendezvousAsksNobodyElse) {
  const RuntimeDirectory directory;
  const auto failed = probebox({"status", "--json"});
  EXPECT_EQ(failed.status, 3);
  EXPECT_EQ(failed.object()["error"], "no-box");
  EXPECT_THAT(failed.err, AllOf(HasSubstr(directory.rendezvous().string()), HasSubstr("PROBEBOX_RENDEZVOUS"),
                                Not(HasSubstr("7627"))));
  EXPECT_EQ(probebox({"list"}).status, 3);
}

TEST(LookingWithoutABox, NamesAUriThatIsNone) {
  for (const auto* uri : {"tcp:127.0.0.1", "http://box", "usbx:123", "tcp:box:99999", ""}) {
    const auto failed = probebox({"-u", uri, "status"});
    if (*uri == '\0') continue;  // an empty URI is as good as none
    EXPECT_EQ(failed.status, 2) << uri;
    EXPECT_THAT(failed.err, HasSubstr(uri));
  }
}

TEST(LookingWithoutABox, ARecordingCannotAnswer) {
  for (const auto* question : {"corrections", "history"}) {
    const auto failed = probebox({"-u", "file:scan.pbx", question});
    EXPECT_EQ(failed.status, 2);
    EXPECT_THAT(failed.err, HasSubstr("recording"));
  }
}

TEST(Cuts, AreOnThePagesOfStatusAndInfo) {
  const FakeBox cutting{{.line_inhibits = true}}, idle;
  for (const std::string page : {"status", "info"}) {
    EXPECT_THAT(probebox({"-u", cutting.uri(), page}).out, HasSubstr("a cut is on"));
    EXPECT_THAT(probebox({"-u", idle.uri(), page}).out, Not(HasSubstr("a cut is on")));
    EXPECT_EQ(probebox({"-u", cutting.uri(), page, "--json"}).object()["cut_in_progress"], true);
    EXPECT_EQ(probebox({"-u", idle.uri(), page, "--json"}).object()["cut_in_progress"], false);
  }
}

// What is wrong is said before a box is asked for anything, or looked for.
TEST(CorrectionsToSet, AreReadWholeBeforeABoxIsAsked) {
  const auto without_box = [](const std::string& option, const std::string& value) {
    const auto done = probebox({"-u", "tcp:127.0.0.1:1", "corrections", option, value});
    EXPECT_EQ(done.status, 2) << option << " " << value;
    return done.err;
  };
  EXPECT_THAT(without_box("--sum", "foo"), AllOf(HasSubstr("screw, swivel"), HasSubstr("rotary, centreline")));
  without_box("--sum", "");
  EXPECT_THAT(without_box("--tell", "B=foo"), HasSubstr("'B=foo'"));
  EXPECT_THAT(without_box("--tell", "B=30,B=40"), AllOf(HasSubstr("'B=40'"), HasSubstr("twice")));
  EXPECT_THAT(without_box("--tell", "A=1e9"), AllOf(HasSubstr("'A=1e9'"), HasSubstr("-3600"), HasSubstr("3600")));
  EXPECT_THAT(without_box("--tell", "tool=4,length=99999"), HasSubstr("'length=99999'"));
  EXPECT_THAT(without_box("--tell", "length=10"), HasSubstr("add tool=NUMBER"));
}

}  // namespace
}  // namespace probebox::command
