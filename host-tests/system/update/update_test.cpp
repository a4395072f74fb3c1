#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>
#include <memory>
#include <signal.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/host/test_host.hpp"
#include "host-tests/support/bundle_file.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "tools/tour/process.hpp"

// The real daemon and the real command. The test plays the updater, which needs root and a box that can restart.
namespace probebox {
namespace {

using namespace std::chrono_literals;
using support::Balances;
using support::TestHost;
using testing::HasSubstr;
using testing::Not;
using tour::Process;

constexpr std::size_t kBytes = 40'000'000;

class UpdateOverTcp : public testing::Test {
 protected:
  UpdateOverTcp() {
    setenv("PROBEBOX_RENDEZVOUS", folder_.path().c_str(), 1);
    const auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    box_ = listener->address();
    std::filesystem::create_directories(reports());
    bundle_ = support::writeBundle(file_, kBytes, "2.0");
    confirm();
  }

  std::string confirmed() const { return folder_.file("confirmed"); }
  void confirm() const { std::ofstream{confirmed()}; }
  std::string uri() const { return "tcp:" + tcp::describe(box_); }
  std::filesystem::path reports() const { return folder_.path() / "reports"; }
  std::filesystem::path requests() const { return folder_.path() / "state" / "update"; }

  void start(bool has_updater = true) {
    std::vector<std::string> command{PROBEBOXD, "--board", "sim", "--state", folder_.file("state"), "--link", uri()};
    if (has_updater) command.insert(command.end(), {"--updater", reports().string(), "--confirmed", confirmed()});
    auto started = Process::start(command, folder_.file("log"));
    ASSERT_TRUE(started) << started.error().what;
    daemon_ = std::make_unique<Process>(std::move(*started));
    host_ = TestHost::connect(uri());
    ASSERT_TRUE(host_);
  }

  // `probebox -u URI ARGUMENTS`, which goes on meanwhile.
  class Command {
   public:
    Command(std::vector<std::string> arguments, std::string log) : log_{std::move(log)} {
      std::fflush(nullptr);
      pid_ = ::fork();
      if (pid_ != 0) return;
      std::vector<char*> raw;
      for (auto& argument : arguments) raw.push_back(argument.data());
      raw.push_back(nullptr);
      [[maybe_unused]] const auto* const out = std::freopen(log_.c_str(), "w", stdout);
      ::dup2(1, 2);
      ::execv(raw.front(), raw.data());
      ::_exit(99);
    }
    Command(const Command&) = delete;
    Command& operator=(const Command&) = delete;
    ~Command() {
      if (pid_ > 0) ::kill(pid_, SIGKILL), ::waitpid(pid_, nullptr, 0);
    }
    void interrupt() const { ::kill(pid_, SIGINT); }
    int status() {
      int status = 0;
      ::waitpid(std::exchange(pid_, -1), &status, 0);
      return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    std::string said() const { return textIn(log_); }

   private:
    std::string log_;
    pid_t pid_{};
  };
  Command update(std::vector<std::string> more = {}) { return command("update", std::move(more), true); }
  Command command(const std::string& name, std::vector<std::string> more, bool with_bundle = false) {
    std::vector<std::string> all{PROBEBOX, "-u", uri(), "--json", name};
    if (with_bundle) all.push_back(file_);
    all.insert(all.end(), more.begin(), more.end());
    return {all, folder_.file("said-" + std::to_string(++commands_))};
  }

  static std::string textIn(const std::filesystem::path& path) {
    std::ifstream in{path, std::ios::binary};
    return {std::istreambuf_iterator<char>{in}, {}};
  }
  static bool eventually(const std::function<bool()>& is_so) {
    for (int round = 0; round < 3000; ++round, std::this_thread::sleep_for(10ms)) {
      if (is_so()) return true;
    }
    return false;
  }
  std::uint64_t received() const {
    std::error_code absent;
    const auto size = std::filesystem::file_size(requests() / "bundle", absent);
    return absent ? 0 : size;
  }
  bool handedOver() const { return std::filesystem::exists(requests() / "request"); }
  // As the updater does it.
  std::string takeRequest() const {
    const auto request = textIn(requests() / "request");
    std::filesystem::remove(requests() / "request");
    return request.substr(0, request.find(' '));
  }
  void report(const std::string& installation, const std::string& state, const std::string& running) const {
    std::ofstream{reports() / "state.new"} << "state " << state << "\ninstallation " << installation
                                           << "\nversion 2.0\nrunning " << running << "\ntext as the updater says\n";
    std::filesystem::rename(reports() / "state.new", reports() / "state");
  }

  const support::TemporaryFolder folder_;
  const std::string file_{folder_.file("box.raucb")};
  std::string bundle_;
  tcp::Address box_;
  std::unique_ptr<Process> daemon_;
  std::unique_ptr<TestHost> host_;
  int commands_{};
};

TEST_F(UpdateOverTcp, FromTheFileToTheVersionThatRuns) {
  start();
  auto update = this->update();
  ASSERT_TRUE(eventually([&] { return handedOver(); })) << update.said();
  EXPECT_EQ(textIn(requests() / "bundle"), bundle_);
  const auto installation = takeRequest();
  report(installation, "installing", "1.0");
  std::this_thread::sleep_for(1200ms);
  report(installation, "installed", "1.0");
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(requests() / "restart"); })) << update.said();
  std::filesystem::remove(requests() / "restart");
  report(installation, "restarting", "1.0");
  host_.reset();
  daemon_->kill(SIGTERM);
  std::this_thread::sleep_for(500ms);
  start();
  std::this_thread::sleep_for(1500ms);
  report(installation, "done", "2.0");
  EXPECT_EQ(update.status(), 0) << update.said();
  EXPECT_THAT(update.said(), HasSubstr("\"state\":\"done\""));
  EXPECT_THAT(update.said(), HasSubstr("\"running_version\":\"2.0\""));
  EXPECT_THAT(update.said(), HasSubstr("\"sent_bytes\":" + std::to_string(bundle_.size())));
  ASSERT_TRUE(eventually([&] { return received() == 0; })) << "the bundle is removed";
  auto status = command("status", {});
  EXPECT_EQ(status.status(), 0);
  EXPECT_THAT(status.said(), testing::AllOf(HasSubstr("\"update\":\"version"), HasSubstr("2.0")));
}

TEST_F(UpdateOverTcp, AKilledDaemonGoesOnWithWhatItHas) {
  start();
  auto update = this->update({"--no-wait"});
  ASSERT_TRUE(eventually([&] { return received() > kBytes / 16; }));
  host_.reset();
  daemon_->kill(SIGKILL);
  const auto had = received();
  ASSERT_LT(had, bundle_.size()) << "it was too quick for this test";
  // As a box that was restarted.
  std::filesystem::remove(confirmed());
  start();
  ASSERT_TRUE(eventually([&] { return update.said().find("has to be found healthy before") != std::string::npos; }))
      << update.said();
  confirm();
  EXPECT_EQ(update.status(), 0) << update.said();
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  EXPECT_EQ(textIn(requests() / "bundle"), bundle_);
  const auto at = update.said().find("\"sent_bytes\":");
  ASSERT_NE(at, std::string::npos) << update.said();
  const auto sent = std::stoull(update.said().substr(at + 13));
  EXPECT_LT(sent, bundle_.size() + 3'000'000) << "what was stored is not sent again: it had " << had;
}

TEST_F(UpdateOverTcp, ALinkThatIsLostIsTakenUpAgain) {
  start();
  auto update = this->update({"--no-wait"});
  ASSERT_TRUE(eventually([&] { return received() > kBytes / 16; }));
  ::kill(daemon_->pid(), SIGSTOP);
  ASSERT_LT(received(), bundle_.size()) << "it was too quick for this test";
  std::this_thread::sleep_for(3500ms);
  ::kill(daemon_->pid(), SIGCONT);
  EXPECT_EQ(update.status(), 0) << update.said();
  EXPECT_THAT(update.said(), HasSubstr("waiting for " + uri() + " to come back"));
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  EXPECT_EQ(textIn(requests() / "bundle"), bundle_);
}

std::size_t sentBytes(const std::string& json) {
  constexpr std::string_view kKey = "\"sent_bytes\":";
  const auto at = json.find(kKey);
  return at == std::string::npos ? 0 : std::stoull(json.substr(at + kKey.size()));
}

TEST_F(UpdateOverTcp, CtrlCLeavesItResumable) {
  start();
  auto first = update();
  ASSERT_TRUE(eventually([&] { return received() > kBytes / 16; }));
  first.interrupt();
  EXPECT_EQ(first.status(), 130);
  EXPECT_THAT(first.said(), HasSubstr("same command"));
  const auto had = received();
  ASSERT_LT(had, bundle_.size()) << "it was too quick for this test";
  auto second = update({"--no-wait"});
  EXPECT_EQ(second.status(), 0) << second.said();
  // Parts of the first may have arrived after it had ended.
  EXPECT_GT(sentBytes(second.said()), 0U);
  EXPECT_LE(sentBytes(second.said()), bundle_.size() - had);
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  EXPECT_EQ(textIn(requests() / "bundle"), bundle_);
}

TEST_F(UpdateOverTcp, SamplesOfAnotherHostLoseNothing) {
  start();
  Balances balances;
  auto host = TestHost::connect(uri(), &balances);
  ASSERT_TRUE(host && host->waitForLock());
  host->client().start({});
  auto update = this->update({"--no-wait"});
  ASSERT_TRUE(host->eventually([&] { return handedOver(); })) << update.said();
  EXPECT_EQ(update.status(), 0);
  host->linger(500ms);
  const auto balance = host->finish();
  EXPECT_TRUE(balance.exact);
  EXPECT_EQ(balance.account.received, balance.produced);
  EXPECT_GT(balances.samples, 500U);
  EXPECT_EQ(balances.exact, balances.heartbeats);
  EXPECT_EQ(host->ask<messages::Status>().ledger.lost_in_queue, 0U);
}

TEST_F(UpdateOverTcp, NothingIsTakenDuringACutOrARun) {
  start();
  host_->ask<messages::SetInhibit>({.active = true, .by = "Ada", .connection = {}});
  auto in_a_cut = update();
  EXPECT_EQ(in_a_cut.status(), 4);
  EXPECT_THAT(in_a_cut.said(), HasSubstr("cut-on: "));
  // The command reads the whole bundle first, and the box drops a host that is silent for so long.
  host_ = TestHost::connect(uri());
  ASSERT_TRUE(host_);
  host_->ask<messages::SetInhibit>({.active = false, .by = "Ada", .connection = {}});
  ASSERT_TRUE(host_->waitForLock());
  host_->ask<messages::StartProcedure>({.method = "delay-multi-speed"});
  ASSERT_TRUE(host_->eventually([&] {
    const auto state = host_->ask<messages::ProcedureStatus>().state;
    return state == RunState::waiting || state == RunState::running;
  }));
  auto in_a_run = update();
  EXPECT_EQ(in_a_run.status(), 4);
  EXPECT_THAT(in_a_run.said(), HasSubstr("run-on: "));
  EXPECT_EQ(received(), 0U);
}

TEST_F(UpdateOverTcp, NothingIsTakenBeforeTheRunningVersionIsConfirmed) {
  std::filesystem::remove(confirmed());
  start();
  auto early = update();
  EXPECT_EQ(early.status(), 4);
  EXPECT_THAT(early.said(), HasSubstr("not-confirmed: "));
  auto shown = command("update", {});
  EXPECT_EQ(shown.status(), 0);
  EXPECT_THAT(shown.said(), HasSubstr("\"why_not\":\"not-confirmed"));
  EXPECT_EQ(received(), 0U);
  confirm();
  EXPECT_EQ(update({"--no-wait"}).status(), 0);
}

TEST_F(UpdateOverTcp, ADaemonWithoutAnUpdaterSaysSo) {
  start(false);
  auto update = this->update();
  EXPECT_EQ(update.status(), 4);
  EXPECT_THAT(update.said(), HasSubstr("no-updater"));
  auto shown = command("update", {});
  EXPECT_EQ(shown.status(), 0);
  EXPECT_THAT(shown.said(), HasSubstr("\"why_not\":\"no-updater"));
}

TEST_F(UpdateOverTcp, WhatTheUpdaterRefusesIsSaidAndIsNotSentTwice) {
  start();
  auto first = update();
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  report(takeRequest(), "not_installed", "2.1");
  EXPECT_EQ(first.status(), 4);
  EXPECT_THAT(first.said(), HasSubstr("not installed"));
  auto second = update({"--force", "--no-wait"});
  EXPECT_EQ(second.status(), 0);
  EXPECT_THAT(second.said(), HasSubstr("\"sent_bytes\":0"));
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  EXPECT_THAT(textIn(requests() / "request"), HasSubstr("although-not-newer"));
}

TEST_F(UpdateOverTcp, ABoxThatGoesBackIsAFailure) {
  start();
  auto update = this->update();
  ASSERT_TRUE(eventually([&] { return handedOver(); }));
  report(takeRequest(), "gone_back", "1.0");
  EXPECT_EQ(update.status(), 1);
  EXPECT_THAT(update.said(), HasSubstr("version 1.0"));
}

TEST_F(UpdateOverTcp, TheVersionThatRunsIsNotSent) {
  report("1", "done", "2.0");
  start();
  auto update = this->update();
  EXPECT_EQ(update.status(), 4);
  EXPECT_THAT(update.said(), testing::AllOf(HasSubstr("version 2.0"), HasSubstr("--force")));
}

TEST_F(UpdateOverTcp, AWrongFileIsNamedBeforeAnythingIsSent) {
  const auto said_of = [&](const std::string& content) {
    std::ofstream{file_, std::ios::binary} << content;
    auto refused = update();
    EXPECT_EQ(refused.status(), 2);
    EXPECT_THAT(refused.said(), HasSubstr("not-a-bundle"));
    return refused.said();
  };
  EXPECT_THAT(said_of(std::string(512, '\0') + "EFI PART" + std::string(600, '\0')), HasSubstr("whole disk"));
  EXPECT_THAT(said_of("\x28\xb5\x2f\xfd" + std::string(2000, 'x')), HasSubstr("zstd"));
  EXPECT_THAT(said_of("!<arch>\ndebian-binary"), HasSubstr("Debian package"));
  EXPECT_THAT(said_of(""), HasSubstr("begin"));
  EXPECT_THAT(said_of(bundle_.substr(0, bundle_.size() - 100)), HasSubstr("signature"));
  EXPECT_THAT(said_of("hsqs"), HasSubstr("signature"));
  std::filesystem::remove(file_);
  auto absent = update();
  EXPECT_EQ(absent.status(), 2);
  EXPECT_THAT(absent.said(), HasSubstr("cannot"));
}

}  // namespace
}  // namespace probebox
