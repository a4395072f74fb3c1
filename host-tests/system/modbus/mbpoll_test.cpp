#include <gmock/gmock.h>
#include <random>
#include <spawn.h>

#include "fixture.hpp"

extern char** environ;

namespace probebox::app {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

published::Snapshot snapshotOf(double x_mm, double y_mm, double z_mm) {
  published::Snapshot snapshot;
  snapshot.valid = true;
  snapshot.clock_locked = true;
  snapshot.correction_mm = {x_mm, y_mm, z_mm};
  snapshot.sequence = 65535;
  snapshot.heartbeat = 77;
  snapshot.age_ms = 1250;
  return snapshot;
}

class ModbusMaster : public ModbusOnCable {};

TEST_F(ModbusMaster, ReadsCorrectionsOfBothSignsInEveryNumberFormat) {
  show(snapshotOf(-0.0125, 0.0301, 1.23456));
  EXPECT_THAT(poll("-r 5 -c 3 -t 4"),
              AllOf(HasSubstr("[5]: \t65411 (-125)"), HasSubstr("[6]: \t301"), HasSubstr("[7]: \t12346")));
  EXPECT_THAT(poll("-r 8 -c 3 -t 4"),
              AllOf(HasSubstr("[8]: \t32643"), HasSubstr("[9]: \t33069"), HasSubstr("[10]: \t45114")));
  EXPECT_THAT(poll("-r 32 -c 3 -t 4:int -B"),
              AllOf(HasSubstr("[32]: \t-12500"), HasSubstr("[34]: \t30100"), HasSubstr("[36]: \t1234560")));
  EXPECT_THAT(poll("-r 16 -c 3 -t 4:float -B"),
              AllOf(HasSubstr("[16]: \t-0.0125"), HasSubstr("[18]: \t0.0301"), HasSubstr("[20]: \t1.23456")));
}

TEST_F(ModbusMaster, ReadsSaturatedValuesWithDegradedSet) {
  show(snapshotOf(-55.5, 1e9, 3.2767));
  EXPECT_THAT(poll("-r 5 -c 3 -t 4"),
              AllOf(HasSubstr("(-32767)"), HasSubstr("[6]: \t32767"), HasSubstr("[7]: \t32767")));
  EXPECT_THAT(poll("-r 32 -c 2 -t 4:int -B"), AllOf(HasSubstr("-3276700"), HasSubstr("[34]: \t3276700")));
  EXPECT_THAT(poll("-r 16 -c 1 -t 4:float -B"), HasSubstr("-3.2767"));
  EXPECT_THAT(poll("-r 2 -c 1 -t 4:hex"), HasSubstr("0x0023"));  // valid, clock locked, degraded
}

TEST_F(ModbusMaster, ReadsTheSameMapByFunctionsThreeAndFour) {
  show(snapshotOf(0.1, 0.2, 0.3));
  for (const auto* const table : {"3:hex", "4:hex"}) {
    EXPECT_THAT(poll(std::string{"-r 0 -c 12 -t "} + table),
                AllOf(HasSubstr("[0]: \t0x5042"), HasSubstr("[1]: \t0x0001"), HasSubstr("[3]: \t0xFFFF"),
                      HasSubstr("[4]: \t0x004D"), HasSubstr("[11]: \t0x000C")));
  }
}

TEST_F(ModbusMaster, IsToldWhatItMayNotDo) {
  EXPECT_THAT(poll("-r " + std::to_string(modbus::kRegisterCount - 2) + " -c 3 -t 4"),
              HasSubstr("Illegal data address"));
  EXPECT_THAT(poll("-r 5 -t 4", "1"), HasSubstr("Illegal data address"));
  EXPECT_THAT(poll("-r 128 -t 4", "2"), HasSubstr("Illegal data value"));
  EXPECT_THAT(poll("-r 0 -c 1 -t 0"), HasSubstr("Illegal function"));
  markers_allowed_ = false;
  EXPECT_THAT(poll("-r 157 -t 4", "1"), HasSubstr("Illegal data value"));
  EXPECT_THAT(markers(), ::testing::IsEmpty());
  EXPECT_TRUE(eventually([&] { return server_->counters().refused == 5; })) << "it counts once it has answered";
}

TEST_F(ModbusMaster, IsAnsweredOnceWhereTheBoxHearsItself) {
  onCable([](serial::EmulatedCable& cable) { cable.echo(serial::EmulatedCable::End::a, true); });
  // Until a read shows that the line echoes, answers to its own echo may still be on it.
  EXPECT_TRUE(eventually([&] {
    return poll("-r 138 -t 4", "1").find("Written 1 references") != std::string::npos &&
           poll("-r 0 -c 2 -t 4:hex").find("0x5042") != std::string::npos;
  }));
  // The master has an answer before the server has counted it. What is still on the line is of before.
  const auto round = server_->rounds();
  EXPECT_TRUE(eventually([&] { return server_->rounds() > round + 1; }));
  clearLine();
  const auto before = server_->counters().answered;
  EXPECT_THAT(poll("-r 138 -t 4", "0"), HasSubstr("Written 1 references"));
  EXPECT_THAT(poll("-r 0 -c 2 -t 4:hex"), HasSubstr("0x5042"));
  const auto last = server_->rounds();
  EXPECT_TRUE(eventually([&] { return server_->rounds() > last + 1; }));
  EXPECT_EQ(server_->counters().answered, before + 2);
}

// What a write takes to be stored is no silence of the line, behind which an echo would be a request.
TEST_F(ModbusMaster, IsAnsweredOnceWhereTheBoxHearsItselfAfterASlowWrite) {
  onCable([](serial::EmulatedCable& cable) { cable.echo(serial::EmulatedCable::End::a, true); });
  EXPECT_TRUE(eventually([&] { return poll("-r 0 -c 2 -t 4:hex").find("0x5042") != std::string::npos; }));
  clearLine();
  disk_time_ = std::chrono::milliseconds{120};
  const auto before = server_->counters().answered;
  EXPECT_THAT(poll("-r 128 -t 4", "1"), HasSubstr("Written 1 references"));
  EXPECT_THAT(poll("-r 0 -c 1 -t 4:hex"), HasSubstr("0x5042"));
  const auto last = server_->rounds();
  EXPECT_TRUE(eventually([&] { return server_->rounds() > last + 1; }));
  EXPECT_EQ(server_->counters().answered, before + 2);
}

TEST_F(ModbusMaster, IsToldOfAFunctionThatTheBoxDoesNotHave) {
  const std::vector<std::uint8_t> request{1, 100, 0x01, 0xCB};
  onCable([&](serial::EmulatedCable& cable) {
    cable.inject(serial::EmulatedCable::End::a, std::as_bytes(std::span{request}));
  });
  EXPECT_TRUE(eventually([&] { return server_->counters().refused == 1; }));
  EXPECT_EQ(server_->counters().bad_frames, 0U);
}

TEST_F(ModbusMaster, SendsAMarkerOnceHoweverOftenItRepeatsTheRequest) {
  // run 7, step 3, end, 25.0 mm/s, tool 2, A 90 degrees, at rest, commit 41
  const std::string marker = "0 7 3 1 250 2 1 24464 0 0 0 0 1 41";
  EXPECT_THAT(poll("-r 144 -t 4", marker), HasSubstr("Written 14 references"));
  EXPECT_THAT(poll("-r 144 -t 4", marker), HasSubstr("Written 14 references"));
  const auto taken = markers();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].procedure, 7U);
  EXPECT_EQ(taken[0].step, 3U);
  EXPECT_EQ(taken[0].phase, MarkerPhase::end);
  EXPECT_DOUBLE_EQ(taken[0].nominal_speed_mm_s, 25.0);
  EXPECT_EQ(taken[0].tool, 2U);
  EXPECT_NEAR(taken[0].rotary_angles_rad[0], 1.5707963267948966, 1e-12);
  EXPECT_TRUE(taken[0].at_rest);
}

TEST_F(ModbusMaster, ChoosesTheWordOrder) {
  show(snapshotOf(-0.5, 0, 0));
  EXPECT_THAT(poll("-r 128 -t 4", "1"), HasSubstr("Written 1 references"));
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int"), HasSubstr("[32]: \t-500000"));
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int -B"), Not(HasSubstr("[32]: \t-500000")));
}

TEST_F(ModbusMaster, IsAnsweredAfterAnotherOneWasKilledInMidPoll) {
  show(snapshotOf(0.25, 0, 0));
  for (int i = 0; i < 3; ++i) {
    const auto before = server_->counters().answered;
    std::string port = cncPort();
    std::vector<std::string> words{"mbpoll", "-m", "rtu", "-a", "1", "-b", "19200", "-P", "none",
                                   "-0",     "-l", "11",  "-r", "0", "-c", "37",    port};
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t quiet;
    posix_spawn_file_actions_init(&quiet);
    posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", 1 /* write only */, 0);
    pid_t master = 0;
    ASSERT_EQ(posix_spawnp(&master, "mbpoll", &quiet, nullptr, arguments.data(), environ), 0);
    posix_spawn_file_actions_destroy(&quiet);
    EXPECT_TRUE(eventually([&] { return server_->counters().answered > before + 3; }));
    kill(master, SIGKILL);
    waitpid(master, nullptr, 0);
  }
  // The dead master's last answer may still lie in the line; a real master clears it when it opens the port.
  EXPECT_TRUE(eventually([&] { return poll("-r 5 -c 1 -t 4").find("[5]: \t2500") != std::string::npos; }));
}

TEST_F(ModbusMaster, GetsRightValuesBetweenBurstsOfGarbage) {
  show(snapshotOf(-0.0125, 0, 0));
  std::mt19937_64 random{20250107};
  std::uint64_t injected = 0;
  for (int burst = 0; burst < 12; ++burst) {
    std::vector<std::byte> noise(1 + random() % 3000);
    for (auto& byte : noise) byte = static_cast<std::byte>(random());
    onCable([&](serial::EmulatedCable& cable) { cable.inject(serial::EmulatedCable::End::a, noise); });
    injected += noise.size();
    EXPECT_TRUE(eventually([&] { return server_->counters().skipped_bytes == injected; }));
    EXPECT_THAT(poll("-r 5 -c 1 -t 4"), HasSubstr("(-125)"));
  }
  EXPECT_GT(server_->counters().bad_frames, 0U);
  EXPECT_THAT(markers(), ::testing::IsEmpty());
}

TEST_F(ModbusMaster, IsAnsweredAfterTheBoxsAdapterWasPulledAndPluggedAgain) {
  show(snapshotOf(0.0042, 0, 0));
  using End = serial::EmulatedCable::End;
  onCable([](serial::EmulatedCable& cable) { cable.unplug(End::a); });
  EXPECT_THAT(poll("-o 0.2 -r 5 -c 1 -t 4"), HasSubstr("timed out"));
  onCable([](serial::EmulatedCable& cable) { EXPECT_TRUE(cable.plug(End::a).ok()); });
  EXPECT_TRUE(eventually([&] { return server_->counters().reopened == 1; }));
  EXPECT_THAT(poll("-r 5 -c 1 -t 4"), HasSubstr("[5]: \t42"));
}

TEST_F(ModbusMaster, FindsTheWordOrderThatItChoseAfterAPulledAdapterAndARestart) {
  show(snapshotOf(-0.003728, 0, 0));
  ASSERT_THAT(poll("-r 128 -t 4", "1"), HasSubstr("Written 1 references"));
  using End = serial::EmulatedCable::End;
  onCable([](serial::EmulatedCable& cable) { cable.unplug(End::a); });
  EXPECT_THAT(poll("-o 0.2 -r 5 -c 1 -t 4"), HasSubstr("timed out"));
  onCable([](serial::EmulatedCable& cable) { EXPECT_TRUE(cable.plug(End::a).ok()); });
  EXPECT_TRUE(eventually([&] { return server_->counters().reopened == 1; }));
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int"), HasSubstr("[32]: \t-3728"));
  EXPECT_THAT(poll("-r 128 -c 1 -t 4"), HasSubstr("[128]: \t1"));
  startServer();
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int"), HasSubstr("[32]: \t-3728")) << "in the first answer";
}

TEST_F(ModbusMaster, IsToldThatAWordOrderCannotBeKept) {
  show(snapshotOf(-0.5, 0, 0));
  disk_takes_ = false;
  EXPECT_THAT(poll("-r 128 -t 4", "1"), HasSubstr("failure"));
  EXPECT_THAT(poll("-r 128 -c 1 -t 4"), HasSubstr("[128]: \t0"));
  EXPECT_THAT(poll("-r 32 -c 1 -t 4:int -B"), HasSubstr("[32]: \t-500000"));
}

TEST_F(ModbusMaster, ReadsTheInhibitOfItsOwnLine) {
  EXPECT_THAT(poll("-r 138 -c 1 -t 4"), HasSubstr("[138]: \t0"));
  inhibits_ = true;
  EXPECT_THAT(poll("-r 138 -c 1 -t 4"), HasSubstr("[138]: \t1"));
}

TEST(ModbusOptions, AreReadOrRefusedByName) {
  const auto good = parseModbusOptions("/dev/ttyS3,baud=38400,unit=17,parity=none,stop=2");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good->line.path, "/dev/ttyS3");
  EXPECT_EQ(serial::describe(good->line.settings), "38400 8N2");
  EXPECT_EQ(good->unit, 17);
  EXPECT_EQ(serial::describe(parseModbusOptions("/dev/ttyS3")->line.settings), "19200 8E1");
  for (const auto* const bad :
       {"", ",unit=1", "/dev/x,unit=0", "/dev/x,unit=248", "/dev/x,unit=1x", "/dev/x,speed=9"}) {
    const auto outcome = parseModbusOptions(bad);
    ASSERT_FALSE(outcome.ok()) << bad;
    EXPECT_THAT(outcome.error().what, ContainsRegex("write|known are"));
  }
}

}  // namespace
}  // namespace probebox::app
