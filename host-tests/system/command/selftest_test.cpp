#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "fake_box.hpp"
#include "in_process.hpp"
#include "tools/probebox/text/report_front_end.hpp"
#include "tools/probebox/text/report_indexes.hpp"
#include "tools/probebox/text/report_loop_back.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

messages::LoopBack::Answer losing(std::uint32_t lost) {
  return {.output = "OUT",
          .input = "IN",
          .pulses = 500,
          .lost = lost,
          .median_ns = 21'300,
          .p99_ns = 48'000,
          .largest_ns = 95'000,
          .bracket_ns = 4000,
          .sigma_ns = 2600};
}

TEST(LoopBackReport, SaysAllFiguresToPeopleAndPrograms) {
  EXPECT_EQ(line(losing(2)),
            "Edges from OUT to IN are stamped 21.3 us late (median), spread 2600 ns, 99 of 100 within 48.0 us, the "
            "latest 95.0 us; the write takes 4000 ns of it; 2 of 500 pulses were lost");
  EXPECT_EQ(nlohmann::ordered_json::parse(describe(losing(2)).dump()),
            nlohmann::ordered_json::parse(R"({"output": "OUT", "input": "IN", "pulses": 500, "lost_pulses": 2,
    "median_lateness_ns": 21300, "p99_lateness_ns": 48000, "largest_lateness_ns": 95000, "bracket_ns": 4000,
    "sigma_ns": 2600})"));
}

// A pulse that a busy box looked at too late is no fault of the wire.
TEST(LoopBackReport, FindsFaultWithAWireThatLosesOneInAHundred) {
  EXPECT_TRUE(judge(losing(0)).good);
  EXPECT_TRUE(judge(losing(4)).good);
  EXPECT_EQ(judge(losing(4)).name, "");
  EXPECT_FALSE(judge(losing(5)).good);
  EXPECT_EQ(judge(losing(5)).name, "pulses-lost");
  EXPECT_THAT(judge(losing(5)).what, HasSubstr("the wire"));
}

// A front end whose inputs are as they should be.
messages::Status::Answer goodReceiver() {
  messages::Status::Answer status;
  status.receiver = {.state = ClockState::locked, .sigma_ns = 900, .frequency_ppb = -12'000, .samples = 5000};
  auto& front_end = status.front_end;
  front_end.serial_number = "E0C9125B0D9B5A25";
  front_end.version = "1.0";
  front_end.packet_version = 3;
  front_end.step_ps = 48'000;
  front_end.sync_out_hz = 1000.016;
  front_end.stated_noise_um = 0.4;
  front_end.inputs = {.samples = 2048,
                      .noise_nm = {120, 130, 110},
                      .lowest_nm = {-900, -800, -700},
                      .highest_nm = {900, 1000, 1100},
                      .clipped = 0,
                      .loop_back_periods = 1000,
                      .shortest_period_steps = 20'832,
                      .longest_period_steps = 20'835};
  return status;
}

std::vector<std::string> failedOf(const messages::Status::Answer& status) {
  std::vector<std::string> names;
  for (const auto& check : receiverChecks(status)) {
    if (check.verdict != MeasuredCheck::Verdict::failed) continue;
    names.push_back(check.name);
    EXPECT_NE(check.remedy, "") << check.name;
  }
  return names;
}

TEST(ReceiverChecks, FindNothingWhereThereIsNoReceiver) {
  EXPECT_TRUE(receiverChecks({}).empty());
}

TEST(ReceiverChecks, NameTheInputThatIsWrong) {
  const auto good = goodReceiver();
  EXPECT_EQ(receiverChecks(good).size(), 5U);
  EXPECT_THAT(failedOf(good), testing::IsEmpty());
  const auto after = [&](auto change) {
    auto status = good;
    change(status);
    return failedOf(status);
  };
  using Status = messages::Status::Answer;
  using testing::ElementsAre;
  EXPECT_THAT(after([](Status& s) { s.front_end.lacks = "edges of lines"; }), ElementsAre("front-end"));
  EXPECT_THAT(after([](Status& s) { s.receiver.frequency_ppb = 210'000; }), ElementsAre("receiver-clock"));
  EXPECT_THAT(after([](Status& s) { s.receiver.frequency_ppb = 150'000; }), testing::IsEmpty())
      << "its crystal, and a rate_hz beside its steps";
  EXPECT_THAT(after([](Status& s) { s.receiver.state = ClockState::unlocked; }), ElementsAre("receiver-clock"));
  EXPECT_THAT(after([](Status& s) { s.front_end.inputs.noise_nm[1] = 450; }), ElementsAre("converter-noise"));
  EXPECT_THAT(after([](Status& s) { s.front_end.inputs.noise_nm[1] = 420; }), testing::IsEmpty())
      << "one window measures a noise of 400 nm as up to 440 nm";
  EXPECT_THAT(after([](Status& s) { s.front_end.inputs.clipped = 1; }), ElementsAre("converter-range"));
  EXPECT_THAT(after([](Status& s) { s.front_end.inputs.lowest_nm[2] = s.front_end.inputs.highest_nm[2]; }),
              ElementsAre("converter-range"));
  EXPECT_THAT(after([](Status& s) { s.front_end.inputs.longest_period_steps = 20'840; }),
              ElementsAre("receiver-stamps"));
}

// Another vendor's receiver is measured as far as it goes.
TEST(ReceiverChecks, DoNotBlameAnotherReceiverForWhatItNeverHad) {
  auto status = goodReceiver();
  status.front_end.version.clear();
  status.front_end.packet_version = 1;
  status.front_end.lacks = "axis counters";
  EXPECT_THAT(failedOf(status), testing::IsEmpty());
  EXPECT_EQ(receiverChecks(status).front().verdict, MeasuredCheck::Verdict::not_told);
  auto unwired = goodReceiver();
  unwired.front_end.inputs.loop_back_periods = 0;
  EXPECT_EQ(receiverChecks(unwired).back().verdict, MeasuredCheck::Verdict::not_told);
}

TEST(ReceiverChecks, SayWhatTheyCannotJudgeYet) {
  auto status = goodReceiver();
  status.front_end.rate_hz = 1000;
  status.front_end.inputs = {};
  const auto early = receiverChecks(status);
  ASSERT_EQ(early.size(), 2U);
  EXPECT_EQ(early.back().verdict, MeasuredCheck::Verdict::not_told);
  EXPECT_THAT(early.back().remedy, HasSubstr("3 s")) << "2048 samples";
  auto slow = goodReceiver();
  slow.front_end.rate_hz = 10'000;
  slow.front_end.sync_out_hz = 4;
  slow.front_end.inputs.loop_back_periods = 0;
  EXPECT_EQ(receiverChecks(slow).back().verdict, MeasuredCheck::Verdict::not_told);
  EXPECT_THAT(receiverChecks(slow).back().remedy, testing::Not(HasSubstr("wire"))) << "it may be wired";
  slow.front_end.sync_out_hz = 5;
  EXPECT_THAT(receiverChecks(slow).back().remedy, HasSubstr("wire"));
}

TEST(IndexReport, NamesAMarkThatIsSilentWhereItsAxisHasNoReference) {
  const std::vector<messages::LineStatus> lines{{.name = "sync", .role = 0, .line = 0, .edges = 0, .lost = 0},
                                                {.name = "index X", .role = 2, .line = 0, .edges = 0, .lost = 0},
                                                {.name = "index Y", .role = 2, .line = 1, .edges = 0, .lost = 0},
                                                {.name = "index Z", .role = 2, .line = 2, .edges = 3, .lost = 0}};
  std::vector<published::AxisState> axes(3);
  axes[0].referenced = true;  // by homing
  const auto findings = silentIndexes(lines, axes);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].name, "index-missing");
  EXPECT_FALSE(findings[0].good);
  EXPECT_THAT(findings[0].what, AllOf(HasSubstr("index Y"), HasSubstr("drive Y")));
}

Finished selftest(const FakeBox& box, const std::atomic<bool>* interrupted = nullptr) {
  return probebox({"-u", box.uri(), "selftest", "--json"}, {}, interrupted);
}

TEST(Selftest, HasTheFiguresOfTheLoopBackForPrograms) {
  const FakeBox box{{.joined = true, .lost_pulses = 1}};
  nlohmann::ordered_json late;
  for (const auto& object : selftest(box).objects()) {
    if (object.contains("loop_back")) late = object;
  }
  ASSERT_FALSE(late.is_null());
  EXPECT_EQ(late["good"], true);
  EXPECT_EQ(late["loop_back"]["p99_lateness_ns"], 48'000);
  EXPECT_EQ(late["loop_back"]["lost_pulses"], 1);
}

// Somebody who gives up waiting has found nothing wrong.
TEST(Selftest, EndsAtCtrlCWhileItWaitsForTheClock) {
  const FakeBox box{{.unlocked = true}};
  std::atomic<bool> interrupted{false};
  std::jthread person{[&] {
    std::this_thread::sleep_for(600ms);
    interrupted = true;
  }};
  const auto ended = selftest(box, &interrupted);
  EXPECT_EQ(ended.status, 130) << ended.out << ended.err;
  EXPECT_THAT(ended.out, AllOf(Not(HasSubstr("clock-unlocked")), Not(HasSubstr("\"wrong\""))));
}

TEST(Selftest, AsksForNothingToBeAccepted) {
  const FakeBox box{{.only_looks = true}};
  const auto done = probebox({"-u", box.uri(), "calibrate", "selftest"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("no result"));
  EXPECT_THAT(done.err, Not(HasSubstr("probebox accept")));
}

}  // namespace
}  // namespace probebox::command
