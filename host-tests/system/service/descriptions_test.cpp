#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sstream>
#include <string>
#include <thread>
#include <unistd.h>

#include "host-tests/support/temporary_folder.hpp"
#include "tools/tour/process.hpp"

// probeboxd --check and the start of the daemon give one answer: what the one accepts the other runs with, what it
// refuses is refused in the same words and with the exit status after which systemd starts nothing again.
namespace probebox {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::StartsWith;
using tour::outputOf;

class DescribedDaemon : public testing::Test {
 protected:
  DescribedDaemon() {
    setenv("XDG_RUNTIME_DIR", folder_.path().c_str(), 1);
    std::filesystem::create_directories(config_);
  }
  ~DescribedDaemon() override { unsetenv("XDG_RUNTIME_DIR"); }

  void write(const char* file, const std::string& text) const { std::ofstream{config_ / file} << text; }
  // A file of the emulated board with one text exchanged for another; the line where that stands.
  std::ptrdiff_t overrule(const char* file, const std::string& from, const std::string& to) const {
    std::ifstream in{std::filesystem::path{SIM_BOARD} / file};
    std::ostringstream text;
    text << in.rdbuf();
    auto changed = text.str();
    const auto at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at == std::string::npos) return 0;
    write(file, changed.replace(at, from.size(), to));
    return 1 + std::count(changed.begin(), changed.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  }

  std::vector<std::string> command() const {
    return {PROBEBOXD, "--board", "sim", "--config", config_.string(), "--state", folder_.file("state")};
  }
  // What the program says until it ends, and "status N" on the last line.
  std::string said(const std::string& more = "") const {
    std::string line;
    for (const auto& word : command()) line += "'" + word + "' ";
    const auto all = outputOf({"sh", "-c", line + more + " 2>&1; echo status $?"});
    EXPECT_TRUE(all) << (all ? "" : all.error().what);
    return all ? *all : "";
  }
  void expectRefused(const std::string& sentence) const {
    const auto checked = said("--check");
    EXPECT_THAT(checked, HasSubstr(sentence));
    EXPECT_TRUE(checked.ends_with("\nstatus 2\n")) << checked;
    EXPECT_EQ(said(), checked);
    EXPECT_FALSE(std::filesystem::exists(folder_.file("state"))) << "nothing was begun";
  }

  const support::TemporaryFolder folder_;
  const std::filesystem::path config_{folder_.path() / "config"};
};

TEST_F(DescribedDaemon, RunsWithWhatTheCheckAccepts) {
  write("service.toml", "links = [\"tcp:127.0.0.1:0\", \"serial:" + folder_.file("not there yet") +
                            "\"]\ncnc = [\"modbus:" + folder_.file("nor this") + "\"]\n");
  EXPECT_THAT(said("--check"), StartsWith("The descriptions are good.\n"));
  auto daemon = tour::Process::start(command(), folder_.file("log"));
  ASSERT_TRUE(daemon) << daemon.error().what;
  const auto log = [&] {
    std::ifstream in{folder_.file("log")};
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  };
  for (int k = 0; k < 600 && log().find("serving tcp:127.0.0.1:") == std::string::npos && daemon->running(); ++k)
    std::this_thread::sleep_for(50ms);
  EXPECT_THAT(log(), HasSubstr("serving tcp:127.0.0.1:"));
  EXPECT_TRUE(daemon->running()) << log();
  daemon->kill(SIGTERM);
}

TEST_F(DescribedDaemon, RefusesAToolWithoutANumber) {
  const auto line = overrule("machine.toml", "number = 1\nlength_mm = 150 ", "length_mm = 150 ");
  expectRefused("machine.toml:" + std::to_string(line - 1) + ": missing key 'tool.number': add it to [tool]");
}

TEST_F(DescribedDaemon, RefusesNumbersThatNothingCouldHold) {
  overrule("box.toml", "period_ns = 1_000_000", "period_ns = 9223372036854775807");
  expectRefused("'sync.period_ns' = 9.22337e+18 is out of its range: give a value from 100000 to 10000000");
}

TEST_F(DescribedDaemon, RefusesAFileInThePlaceOfALine) {
  write("service.toml", "links = [\n\"serial:/etc/passwd\"]\n");
  expectRefused("service.toml:2: 'links': /etc/passwd: this is an ordinary file, no serial line");
}

TEST_F(DescribedDaemon, TellsAllProblemsOfAllFilesAtOnce) {
  overrule("probe.toml", "rate_hz = 2000", "rate_hz = nan");
  overrule("machine.toml", "sense = 1 ", "sense = 0 ");
  expectRefused("'axis.X.sense' = 0 is no direction");
  expectRefused("'probe.rate_hz' = nan is out of its range: give a value from 10 to 1000000");
}

TEST_F(DescribedDaemon, RefusesWhatIsNoDescription) {
  write("box.toml", std::string(300'000, '['));
  expectRefused("box.toml:1: the file has 200000 bytes or more");
  std::filesystem::remove(config_ / "box.toml");
  std::filesystem::create_symlink("/dev/zero", config_ / "box.toml");
  expectRefused("box.toml: it is no ordinary file");
}

}  // namespace
}  // namespace probebox
