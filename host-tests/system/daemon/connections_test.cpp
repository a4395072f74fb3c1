// Connections, sockets and lines of a controller.
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include "drivers/serial/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "running_daemon.hpp"

namespace probebox::app {
namespace {

TEST_F(RunningDaemon, GivesEveryConnectionItsOwnRights) {
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
                                                 << "[[connection]]\naddress = \"" << line
                                                 << "\"\nallow_homing = true\n";
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

// Both addresses are of TCP; the second one is another connection.
TEST_F(RunningDaemon, EndsTheCutOfNoOtherAddress) {
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"}
      << "links = [\"tcp:127.0.0.1:0\", \"tcp:127.0.0.2:0\"]\n[access]\nallow_inhibit = true\n"
      << "[[connection]]\naddress = \"tcp:127.0.0.2:0\"\nallow_inhibit = true\n";
  options.links = {};
  start();
  const auto one = connect(), beside_it = connect(), other = TestHost::connect(daemon->uris().at(1));
  ASSERT_TRUE(one && beside_it && other);
  one->ask<messages::SetInhibit>({.active = true});
  other->ask<messages::SetInhibit>({.active = false});
  const auto held = other->ask<messages::Status>().inhibits;
  ASSERT_EQ(held.size(), 1U) << "it ended the other's cut";
  EXPECT_EQ(held.front().connection, "tcp:127.0.0.1:0") << "as service.toml names it";
  beside_it->ask<messages::SetInhibit>({.active = false});
  EXPECT_TRUE(other->ask<messages::Status>().inhibits.empty()) << "hosts of one address share one";
}

TEST_F(RunningDaemon, LetsOtherComputersInOnlyToLook) {
  const auto loaded = loadDescriptions(options);
  ASSERT_TRUE(loaded);
  for (const auto* address : {"tcp:0.0.0.0:0", "tcp:[::]:0", "tcp:10.0.0.7:7627", "tcp:mill-3:7627"}) {
    options.links = {address};
    const auto refused = validate(options, *loaded);
    ASSERT_TRUE(refused) << address;
    EXPECT_THAT(refused->what, testing::AllOf(testing::HasSubstr("ssh -L"), testing::HasSubstr("read_only = true")));
  }
  options.config = folder / "config";
  std::filesystem::create_directories(options.config);
  std::ofstream{options.config / "service.toml"} << "links = [\"tcp:0.0.0.0:0\"]\n[access]\nallow_inhibit = true\n"
                                                 << "[[connection]]\naddress = \"tcp:0.0.0.0:0\"\nread_only = true\n";
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

TEST_F(RunningDaemon, ServesThroughASocketThatTheServiceManagerOpened) {
  const auto manager = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
  ASSERT_TRUE(manager) << manager.error().what;
  const auto uri = "tcp:" + tcp::describe(manager->address());
  options.links = {uri};  // the same address, which must not be opened twice
  std::vector<PassedSocket> passed;
  passed.push_back({io::Descriptor{dup(manager->descriptor())}, "probeboxd.socket"});
  start(std::move(passed));
  EXPECT_THAT(daemon->uris(), testing::ElementsAre(uri));
  const auto host = connect();
  ASSERT_TRUE(host);
  // The other one is the emulated controller.
  EXPECT_TRUE(host->eventually([&] { return host->ask<messages::Status>().links == 2; }));
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

}  // namespace
}  // namespace probebox::app
