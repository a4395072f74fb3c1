#include "firmware/app/wiring/daemon.hpp"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include "board/describe/sim_files.hpp"
#include "drivers/serial/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/host/test_host.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using messages::ProcedureState;
using support::Balances;
using support::TestHost;

// A daemon with the emulated machine in this process, and a host that speaks to it over TCP.
class RunningDaemon : public testing::Test {
 protected:
  RunningDaemon() {
    std::filesystem::create_directories(folder);
    setenv("PROBEBOX_RENDEZVOUS", folder.c_str(), 1);
    options.state = folder / "state";
    options.links = {"tcp:127.0.0.1:0"};
    options.time_scale = 4;
  }
  ~RunningDaemon() override {
    daemon.reset();
    std::filesystem::remove_all(folder);
  }

  void start(std::vector<PassedSocket> passed = {}) {
    auto loaded = loadDescriptions(options);
    ASSERT_TRUE(loaded) << loaded.error().what;
    descriptions = *loaded;
    auto started = Daemon::start(options, descriptions, std::move(passed));
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::move(*started);
  }
  // The emulated board with one text exchanged for another.
  void overrule(const char* file, const std::string& from, const std::string& to) {
    options.config = folder / "config";
    std::filesystem::create_directories(options.config);
    std::string text{board::simFile(file)};
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream{options.config / file} << text.replace(at, from.size(), to);
  }
  std::unique_ptr<TestHost> connect(link::StreamListener* listener = nullptr) {
    return TestHost::connect(daemon->uris().front(), listener);
  }

  const std::filesystem::path folder =
      std::filesystem::path{testing::TempDir()} / ("probeboxd-" + std::to_string(getpid()));
  Options options;
  board::Descriptions descriptions;
  std::unique_ptr<Daemon> daemon;
};

TEST_F(RunningDaemon, CalibratesTheDelayByTouchesAndRestoresItAfterARestart) {
  start();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto status = host->calibrate();
  ASSERT_EQ(status.state, ProcedureState::proposed) << status.refusal;

  const auto results = host->ask<messages::ListResults>().results;
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].id, status.result_id);
  EXPECT_EQ(results[0].state, messages::ResultState::proposed);
  const auto& tau = results[0].values.front();
  ASSERT_EQ(tau.key, "tau_s");
  const auto& delays = descriptions.world->delays;
  const double truth = delays.tau_machine_s[0] - delays.tau_probe_s;
  EXPECT_GT(tau.sd, 1e-7);
  EXPECT_LT(tau.sd, 5e-5);
  EXPECT_LT(std::abs(tau.value - truth), 5 * tau.sd);

  EXPECT_FALSE(host->ask<messages::Corrections>().delay_calibrated);  // a result changes nothing by itself
  host->ask<messages::AcceptResult>({.id = status.result_id, .by = "somebody"});
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay_calibrated; }));
  EXPECT_EQ(host->ask<messages::Corrections>().tau_s[2], tau.value);

  host.reset();
  daemon.reset();
  start();
  host = connect();
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().delay_calibrated; }));
  EXPECT_EQ(host->ask<messages::Corrections>().tau_s[0], tau.value);
}

TEST_F(RunningDaemon, LetsAnAcceptedResultWaitForTheEndOfACut) {
  start();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto status = host->calibrate();
  ASSERT_EQ(status.state, ProcedureState::proposed) << status.refusal;
  const auto calibrated = [&] { return host->ask<messages::Corrections>().delay_calibrated; };

  host->ask<messages::SetInhibit>({.active = true});
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().inhibited; }));
  const auto accepted = host->ask<messages::AcceptResult>({.id = status.result_id, .by = "a machinist"});
  EXPECT_EQ(accepted.state, messages::ResultState::accepted);
  EXPECT_TRUE(accepted.waiting_for_cut);
  EXPECT_FALSE(calibrated());
  EXPECT_THAT(host->refusal<messages::EnableSources>({.mask = 1}).what, testing::HasSubstr("cut"));
  host->ask<messages::SetInhibit>({.active = false});
  ASSERT_TRUE(host->eventually(calibrated)) << "it comes into force by itself";

  const auto back = host->ask<messages::RollbackResult>({.id = 0, .subject = "delay", .by = "somebody else"});
  EXPECT_EQ(back.retired_id, status.result_id);
  EXPECT_EQ(back.active_id, 0U);
  ASSERT_TRUE(host->eventually([&] { return !calibrated(); }));
  std::vector<messages::ResultState> states;
  for (const auto& transition : host->ask<messages::ResultHistory>().transitions) states.push_back(transition.state);
  using State = messages::ResultState;
  EXPECT_THAT(states, testing::ElementsAre(State::proposed, State::accepted, State::active, State::retired));
}

TEST_F(RunningDaemon, CorrectsScrewsThatWarmUpOnceTheMachineIsHomed) {
  start();
  auto host = connect();
  messages::Corrections::Answer now;
  ASSERT_TRUE(host->eventually([&] {
    now = host->ask<messages::Corrections>();
    return now.valid && std::abs(now.correction_mm[0]) > 1e-5;
  }));
  EXPECT_TRUE(now.referenced);
  EXPECT_EQ(now.mask, 1);
  EXPECT_LT(now.correction_mm[0], 0) << "a screw that is too long pushes the nut ahead";
  ASSERT_EQ(now.axes.size(), 3U);
  EXPECT_GT(now.axes[0].extension_um, 0);
  host->ask<messages::EnableSources>({.mask = 0});
  ASSERT_TRUE(host->eventually([&] {
    now = host->ask<messages::Corrections>();
    return now.mask == 0 && now.correction_mm == std::array<double, 3>{};
  })) << "what was added is taken back";
}

TEST_F(RunningDaemon, HomesNoAxisOutsideOfItsTravel) {
  start();
  auto host = connect();
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::Corrections>().referenced; }));
  const auto refusal = host->refusal<messages::HomeAxes>({.axes = 7, .position_mm = {100, 100, 1e6}});
  EXPECT_EQ(refusal.code, messages::ErrorCode::refused);
  EXPECT_THAT(refusal.what, testing::AllOf(testing::HasSubstr("axis Z"), testing::HasSubstr("-400 mm to 50 mm")));
  for (const auto& axis : host->ask<messages::Corrections>().axes)
    EXPECT_LT(std::abs(axis.position_mm), 500) << "nothing was homed";
}

TEST_F(RunningDaemon, StreamsSamplesWithALedgerThatBalancesAtEveryHeartbeat) {
  start();
  Balances balances;
  auto host = connect(&balances);
  ASSERT_TRUE(host->waitForLock());
  host->client().start({});
  ASSERT_TRUE(host->eventually([&] { return balances.heartbeats > 20 && balances.samples > 2000; }));
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(closing.account.total(), closing.produced);
  EXPECT_EQ(balances.exact, balances.heartbeats);
}

// What the stream tells of triggers is what the corrections' answer, and so the registers, tell of the last one.
TEST_F(RunningDaemon, StreamsEveryTriggerWithThePositionThatTheRegistersHave) {
  struct Triggers : link::StreamListener {
    void onTrigger(const messages::Trigger& trigger) override { all.push_back(trigger); }
    void onTriggerGap(const messages::TriggerGap& gap) override { lost += gap.count; }
    std::vector<messages::Trigger> all;
    std::uint64_t lost{};
  } triggers;
  start();
  auto host = connect(&triggers);
  ASSERT_TRUE(host->waitForLock());
  ASSERT_TRUE(host->eventually([&] { return host->ask<messages::ProcedureStatus>().referenced; }));
  messages::Start wish;
  wish.triggers = true;
  host->client().start(wish);
  ASSERT_EQ(host->calibrate().state, ProcedureState::proposed);
  const auto last = host->ask<messages::Corrections>().last_trigger;
  ASSERT_GT(last.number, 20U);
  ASSERT_TRUE(host->eventually([&] { return !triggers.all.empty() && triggers.all.back().number >= last.number; }));
  EXPECT_EQ(triggers.lost, 0U);
  for (std::size_t k = 0; k < triggers.all.size(); ++k) {
    const auto& trigger = triggers.all[k];
    EXPECT_EQ(trigger.number, triggers.all.front().number + k);
    EXPECT_EQ(trigger.has_position, 7U);
    if (trigger.number != last.number) continue;
    EXPECT_EQ(trigger.position_mm, last.position_mm);
    EXPECT_EQ(trigger.correction_mm, last.correction_mm);
    EXPECT_EQ(trigger.sequence, last.sequence);
  }
  host->finish();
  EXPECT_TRUE(host->client().reader().triggers().exact());
}

TEST_F(RunningDaemon, MeasuresHowLateItStampsItsOwnPulses) {
  start();
  auto host = connect();
  const auto late = host->ask<messages::LoopBack>({.pulses = 2000});
  EXPECT_EQ(late.pulses, 2000U);
  EXPECT_EQ(late.output, "gpiochip0 line 10 (loop-back output)");
  // The median of what the emulated kernel adds: its bias and the median of its jitter, with half of the write.
  const auto& clock = descriptions.world->clock;
  const double expected_ns = 1e3 * (clock.bias_us + clock.jitter_us) + static_cast<double>(late.bracket_ns) / 2;
  EXPECT_NEAR(static_cast<double>(late.median_ns), expected_ns, 500);
  EXPECT_GT(late.p99_ns, late.median_ns + 2 * late.sigma_ns);
  EXPECT_GE(late.largest_ns, late.p99_ns);
  EXPECT_NE(host->ask<messages::LoopBack>().median_ns, late.median_ns) << "measured anew, 500 pulses";

  EXPECT_THAT(host->refusal<messages::LoopBack>({.pulses = 2001}).what, testing::HasSubstr("ask for 10 to 2000"));
  EXPECT_EQ(host->refusal<messages::LoopBack>({.pulses = 9}).code, messages::ErrorCode::refused);
}

TEST_F(RunningDaemon, SaysWhyItCannotMeasureItsOwnPulses) {
  overrule("box.toml", "[loop_back]\noutput = { chip = \"gpiochip0\", line = 10 }\ninput = {", "# {");
  start();
  const auto none = connect()->refusal<messages::LoopBack>();
  EXPECT_EQ(none.code, messages::ErrorCode::not_found);
  EXPECT_THAT(none.what, testing::HasSubstr("name both in [loop_back] of box.toml"));
  daemon.reset();

  overrule("service.toml", "allow_calibrate = true", "allow_calibrate = false");
  start();
  EXPECT_EQ(connect()->refusal<messages::LoopBack>().code, messages::ErrorCode::not_permitted);
}

TEST_F(RunningDaemon, RefusesWithAReasonWhatServiceTomlDoesNotAllow) {
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = []\ncnc = []\n[access]\n[stream]\n";
  start();
  auto host = connect();
  ASSERT_TRUE(host->waitForLock());
  const auto refused = host->refusal<messages::StartProcedure>({.method = "delay-multi-speed"});
  EXPECT_EQ(refused.code, messages::ErrorCode::not_permitted);
  EXPECT_THAT(refused.what, testing::HasSubstr("allow_calibrate"));
}

TEST_F(RunningDaemon, GivesEveryDoorItsOwnRights) {
  auto cable = serial::EmulatedCable::open(folder / "box", folder / "host");
  ASSERT_TRUE(cable) << cable.error().what;
  std::jthread carrier{[&](const std::stop_token& stop) {
    while (!stop.stop_requested()) cable->pump(2ms);
  }};
  const auto line = "serial:" + (folder / "box").string();
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = [\"tcp:127.0.0.1:0\", \"" << line << "\"]\n"
                                                 << "[access]\nallow_marker = true\nallow_inhibit = true\n"
                                                 << "[[door]]\naddress = \"" << line << "\"\nallow_homing = true\n";
  options.links = {};
  start();
  const auto over_tcp = connect();
  const auto over_line = TestHost::connect("serial:" + (folder / "host").string());
  ASSERT_TRUE(over_tcp && over_line);
  const messages::SetInhibit::Request cut{.active = false};
  const messages::HomeAxes::Request home{.axes = 1, .position_mm = {0, 0, 0}};
  EXPECT_EQ(over_line->refusal<messages::SetInhibit>(cut).code, messages::ErrorCode::not_permitted);
  EXPECT_THAT(over_line->refusal<messages::SetInhibit>(cut).what, testing::HasSubstr("allow_inhibit"));
  over_tcp->ask<messages::SetInhibit>(cut);
  EXPECT_EQ(over_tcp->refusal<messages::HomeAxes>(home).code, messages::ErrorCode::not_permitted);
  EXPECT_THAT(over_tcp->refusal<messages::HomeAxes>(home).what, testing::HasSubstr("allow_homing"));
  over_line->ask<messages::HomeAxes>(home);
}

TEST_F(RunningDaemon, LetsOtherComputersInOnlyToLook) {
  const auto loaded = loadDescriptions(options);
  ASSERT_TRUE(loaded);
  for (const auto* address : {"tcp:0.0.0.0:0", "tcp:[::]:0", "tcp:10.0.0.7:7627", "tcp:mill-3:7627"}) {
    options.links = {address};
    const auto refused = whyRefused(options, *loaded);
    ASSERT_TRUE(refused) << address;
    EXPECT_THAT(refused->what, testing::AllOf(testing::HasSubstr("ssh -L"), testing::HasSubstr("read_only = true")));
  }
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = [\"tcp:0.0.0.0:0\"]\n[access]\nallow_inhibit = true\n"
                                                 << "[[door]]\naddress = \"tcp:0.0.0.0:0\"\nread_only = true\n";
  options.links = {};
  start();
  const auto host =
      TestHost::connect("tcp:127.0.0.1:" + daemon->uris().front().substr(std::string{"tcp:0.0.0.0:"}.size()));
  ASSERT_TRUE(host);
  EXPECT_TRUE(host->waitForLock());
  EXPECT_EQ(host->refusal<messages::SetInhibit>({.active = true}).code, messages::ErrorCode::not_permitted);
}

TEST_F(RunningDaemon, RefusesASocketThatOthersReachUnlessItIsReadOnly) {
  const auto manager = tcp::Listener::open({.host = "0.0.0.0", .port = 0});
  ASSERT_TRUE(manager) << manager.error().what;
  const auto loaded = loadDescriptions(options);
  std::vector<PassedSocket> passed;
  passed.push_back({io::Descriptor{dup(manager->descriptor())}, "probeboxd.socket"});
  const auto started = Daemon::start(options, *loaded, std::move(passed));
  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().what, testing::HasSubstr("read_only = true"));
}

TEST_F(RunningDaemon, TakesNoNameThatIsNone) {
  start();
  const auto host = connect();
  for (const auto& by :
       {std::string{}, std::string{"  "}, std::string{"Ada\n9 active by Bob"}, std::string{"\x1b[2J"}}) {
    EXPECT_EQ(host->refusal<messages::AcceptResult>({.id = 1, .by = by}).code, messages::ErrorCode::malformed) << by;
    EXPECT_THAT(host->refusal<messages::RollbackResult>({.id = 0, .subject = "delay", .by = by}).what,
                testing::HasSubstr("name of the person"));
  }
}

TEST_F(RunningDaemon, ServesThroughASocketThatTheServiceManagerOpened) {
  const auto manager = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
  ASSERT_TRUE(manager) << manager.error().what;
  const auto uri = "tcp:" + tcp::describe(manager->address());
  options.links = {uri};  // the same door, which must not be opened twice
  std::vector<PassedSocket> passed;
  passed.push_back({io::Descriptor{dup(manager->descriptor())}, "probeboxd.socket"});
  start(std::move(passed));
  EXPECT_THAT(daemon->uris(), testing::ElementsAre(uri));
  EXPECT_EQ(connect()->ask<messages::Status>().links, 2U);  // and the emulated controller
}

TEST_F(RunningDaemon, RefusesToStartWithASocketThatHostsCannotComeThrough) {
  auto loaded = loadDescriptions(options);
  ASSERT_TRUE(loaded);
  std::vector<PassedSocket> passed;
  passed.push_back({io::Descriptor{socket(AF_INET, SOCK_DGRAM, 0)}, "other.socket"});
  const auto started = Daemon::start(options, *loaded, std::move(passed));
  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().what, testing::HasSubstr("'other.socket'"));
}

TEST_F(RunningDaemon, ServesACncAtTheSocketThatTheManagerOpenedForIt) {
  auto manager = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
  ASSERT_TRUE(manager);
  const auto at = manager->address();
  options.cnc = {"modbus-tcp:" + tcp::describe(at)};
  std::vector<PassedSocket> passed;
  passed.push_back({io::Descriptor{dup(manager->descriptor())}, "probeboxd.socket"});
  start(std::move(passed));
  const auto host = connect();
  auto master = tcp::connectTcp(at, 10s);
  ASSERT_TRUE(master) << master.error().what;
  const std::array<std::uint8_t, 12> read{0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
  (*master)->write(std::as_bytes(std::span{read}));
  std::vector<std::byte> answer;
  EXPECT_TRUE(host->eventually([&] {
    std::array<std::byte, 64> buffer{};
    const auto got = (*master)->read(buffer);
    answer.insert(answer.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    return answer.size() >= 11;
  }));
  ASSERT_EQ(answer.size(), 11U);
  EXPECT_EQ(answer[9], std::byte{0x50});
  EXPECT_EQ(answer[10], std::byte{0x42});
  messages::Status::Answer status;
  EXPECT_TRUE(host->eventually([&] {
    status = host->ask<messages::Status>();
    return status.cnc_lines.front().answered == 1;
  }));
  EXPECT_EQ(status.cnc_lines.front().name, tcp::describe(at));
}

TEST_F(RunningDaemon, RefusesToStartWhereTheCncsPortIsTaken) {
  auto other = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
  ASSERT_TRUE(other);
  options.cnc = {"modbus-tcp:" + tcp::describe(other->address())};
  auto loaded = loadDescriptions(options);
  ASSERT_TRUE(loaded);
  const auto started = Daemon::start(options, *loaded);
  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().what, testing::HasSubstr(std::to_string(other->address().port)));
}

TEST_F(RunningDaemon, ShowsWhatEveryCncLineBrought) {
  auto cable = serial::EmulatedCable::open(folder / "box", folder / "cnc");
  ASSERT_TRUE(cable) << cable.error().what;
  options.cnc = {"modbus:" + (folder / "box").string(), "modbus:" + (folder / "nothing").string()};
  start();
  const auto host = connect();
  const std::vector<std::byte> garbage(100, std::byte{0x55});
  messages::Status::Answer status;
  EXPECT_TRUE(host->eventually([&] {
    cable->inject(serial::EmulatedCable::End::a, garbage);
    cable->pump(0ms);
    status = host->ask<messages::Status>();
    return status.cnc_lines.front().skipped_bytes >= garbage.size();
  }));
  ASSERT_EQ(status.cnc_lines.size(), 2U);
  EXPECT_EQ(status.cnc_lines[0].name, (folder / "box").string());
  EXPECT_GT(status.cnc_lines[0].bad_frames, 0U);
  EXPECT_EQ(status.cnc_lines[1].skipped_bytes, 0U);
  EXPECT_EQ(status.modbus.bad_frames, status.cnc_lines[0].bad_frames);
}

TEST_F(RunningDaemon, RefusesAMethodThatItDoesNotHaveAndNamesThoseItHas) {
  start();
  auto host = connect();
  const auto refused = host->refusal<messages::StartProcedure>({.method = "delay-by-guess"});
  EXPECT_EQ(refused.code, messages::ErrorCode::not_found);
  EXPECT_THAT(refused.what, testing::HasSubstr("delay-multi-speed"));
}

}  // namespace
}  // namespace probebox::app
