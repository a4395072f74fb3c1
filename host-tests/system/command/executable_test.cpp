// The program itself, with real signals: what no call inside a process can show.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iomanip>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "fake_box.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;

class Program {
 public:
  Program(std::vector<std::string> arguments, const std::string& log) {
    arguments.insert(arguments.begin(), PROBEBOX_PROGRAM);
    std::vector<char*> words;
    for (auto& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
      ::dup2(out, STDOUT_FILENO);
      ::dup2(out, STDERR_FILENO);
      ::execv(words.front(), words.data());
      ::_exit(127);
    }
  }
  void signal(int number) const { ::kill(pid_, number); }
  pid_t pid() const { return pid_; }
  int wait() const {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t pid_{};
};

class RunningProgram : public testing::Test {
 protected:
  // Waits until the recording has content: then the program is in the middle of its work.
  void waitForContent() const {
    std::error_code absent;
    for (int i = 0; i < 3000; ++i) {
      if (const auto size = std::filesystem::file_size(file_, absent); !absent && size > 20'000) return;
      std::this_thread::sleep_for(10ms);
    }
    FAIL() << "nothing was recorded";
  }
  Program record() const { return {{"-u", box_.uri(), "record", "-o", file_}, directory_.file("log")}; }

  RuntimeDirectory directory_;
  FakeBox box_;
  std::string file_ = directory_.file("scan.pbx");
};

TEST_F(RunningProgram, EndsWith130AtCtrlCAndLeavesAWholeRecording) {
  for (const int number : {SIGINT, SIGTERM}) {
    const auto program = record();
    waitForContent();
    program.signal(number);
    EXPECT_EQ(program.wait(), 130);
    const auto exported = probebox({"export", file_, "-o", "-", "--json"});
    EXPECT_EQ(exported.status, 0) << exported.err;
    EXPECT_THAT(exported.err, testing::HasSubstr("\"end_known\":true"));
    std::filesystem::remove(file_);
  }
}

bool catches(pid_t process, int number) {
  std::ifstream status{"/proc/" + std::to_string(process) + "/status"};
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("SigCgt:")) return (std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1U) != 0;
  }
  return false;
}

// A case of a million points, after one that is answered at once.
TEST_F(RunningProgram, EndsAtOneCtrlCInTheMiddleOfASolution) {
  const auto write = [&](const std::string& name, int points) {
    std::filesystem::create_directory(directory_.file(name));
    std::ofstream{directory_.file(name) + "/config.json"} << R"({"method":"sphere-fit","radius_mm":10})";
    std::ofstream rows{directory_.file(name) + "/points.csv"};
    rows << "x_mm,y_mm,z_mm\n" << std::setprecision(9);
    for (int k = 0; k < points; ++k) {
      const double height = 2.0 * k / points - 1, around = std::sqrt(1 - height * height);
      rows << 10 * around * std::cos(k) << ',' << 10 * around * std::sin(k) << ',' << 10 * height << '\n';
    }
  };
  write("quick", 20);
  write("slow", 1'000'000);
  for (const std::string command : {"solve", "report"}) {
    const auto log = directory_.file(command + ".log"), page = directory_.file("page.html");
    std::vector<std::string> arguments{command, directory_.file("quick"), directory_.file("slow")};
    if (command == "report") arguments.insert(arguments.end(), {"-o", page});
    const Program program{arguments, log};
    const auto begun = [&] {
      std::error_code absent;
      const auto size = std::filesystem::file_size(log, absent);
      return catches(program.pid(), SIGTERM) && (command == "report" || (!absent && size > 0));
    };
    for (int i = 0; i < 3000 && !begun(); ++i) std::this_thread::sleep_for(10ms);
    std::this_thread::sleep_for(200ms);
    program.signal(SIGTERM);
    EXPECT_EQ(program.wait(), 130) << command;
    EXPECT_FALSE(std::filesystem::exists(page));
    std::ifstream said{log};
    const std::string answers{std::istreambuf_iterator<char>{said}, {}};
    EXPECT_EQ(std::ranges::count(answers, '\n'), command == "solve" ? 1 : 0) << "whole answers alone";
  }
}

// A recording that comes through a pipe may pause for long.
TEST_F(RunningProgram, EndsAtOneCtrlCWhileItWaitsForItsInput) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const auto child = ::fork();
  if (child == 0) {
    ::dup2(ends[0], STDIN_FILENO);
    ::close(ends[0]);
    ::close(ends[1]);
    ::execl(PROBEBOX_PROGRAM, PROBEBOX_PROGRAM, "-u", "file:-", "verify", nullptr);
    ::_exit(127);
  }
  ::close(ends[0]);
  for (int i = 0; i < 3000 && !catches(child, SIGINT); ++i) std::this_thread::sleep_for(10ms);
  std::this_thread::sleep_for(500ms);  // longer than it takes to begin to wait
  ::kill(child, SIGINT);
  int status = 0;
  pid_t ended = 0;
  for (int i = 0; i < 1000 && ended == 0; ++i) {
    ended = ::waitpid(child, &status, WNOHANG);
    if (ended == 0) std::this_thread::sleep_for(10ms);
  }
  ::close(ends[1]);
  if (ended == 0) ::waitpid(child, &status, 0);
  EXPECT_EQ(ended, child) << "it waited on until its input ended";
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
}

// The next file that is opened would get the number of a closed stream, and the text that is meant for a person.
TEST_F(RunningProgram, WritesNothingIntoItsLinkWhereItsOutputIsClosed) {
  const auto child = ::fork();
  if (child == 0) {
    ::close(STDOUT_FILENO);
    ::execl(PROBEBOX_PROGRAM, PROBEBOX_PROGRAM, "-u", box_.uri().c_str(), "status", nullptr);
    ::_exit(127);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 2) << "nobody can read it";
  const auto other = probebox({"-u", box_.uri(), "status"});
  EXPECT_EQ(other.status, 0) << "the box was not disturbed; " << other.err;
}

TEST_F(RunningProgram, LeavesAReadableRecordingWhenKilled) {
  const auto program = record();
  waitForContent();
  program.signal(SIGKILL);
  EXPECT_EQ(program.wait(), -SIGKILL);
  const auto exported = probebox({"export", file_, "-o", "-"});
  EXPECT_EQ(exported.status, 1) << exported.err;
  EXPECT_THAT(exported.err, testing::HasSubstr("not whole"));
  EXPECT_GT(std::count(exported.out.begin(), exported.out.end(), '\n'), 100);
  EXPECT_EQ(probebox({"-u", box_.uri(), "status"}).status, 0) << "the box goes on";
}

class Unread : public RunningProgram, public testing::WithParamInterface<std::vector<std::string>> {};

// As head, which has seen enough: no error, and no word about a full disk.
TEST_P(Unread, EndsQuietlyWhenTheReaderOfItsOutputGoesAway) {
  const auto log = directory_.file("log");
  std::vector<std::string> arguments{PROBEBOX_PROGRAM, "-u", box_.uri()};
  arguments.insert(arguments.end(), GetParam().begin(), GetParam().end());
  std::vector<char*> words;
  for (auto& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const auto child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::dup2(::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
    ::close(ends[0]);
    ::close(ends[1]);
    ::execv(words.front(), words.data());
    ::_exit(127);
  }
  ::close(ends[1]);
  char some[1000];
  EXPECT_GT(::read(ends[0], some, sizeof some), 0);
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGPIPE);
  std::ifstream words_said{log};
  const std::string said{std::istreambuf_iterator<char>{words_said}, {}};
  EXPECT_THAT(said, testing::Not(testing::HasSubstr("written"))) << said;
}

INSTANTIATE_TEST_SUITE_P(Endless, Unread,
                         testing::Values(std::vector<std::string>{"record", "-o", "-"},
                                         std::vector<std::string>{"watch"},
                                         std::vector<std::string>{"corrections", "--follow"}));

TEST_F(RunningProgram, FailsOnAFullDisk) {
  const Program program{{"-u", box_.uri(), "status"}, "/dev/full"};
  EXPECT_EQ(program.wait(), 2);
}

// 64 kB are the most that a file may have here: the disk is full in the middle of the table.
TEST_F(RunningProgram, LeavesNoHalfWrittenTable) {
  const auto table = directory_.file("scan.csv"), packed = directory_.file("packed.pbx");
  std::ofstream rows{table};
  rows << "sample,x\n";
  for (int k = 0; k < 20'000; ++k) rows << k << ',' << k << '\n';
  rows.close();
  ASSERT_EQ(probebox({"pack", table, packed}).status, 0);
  for (const std::string name : {"out.csv", "out.npy"}) {
    const auto out = directory_.file(name);
    std::ofstream{out} << "of before";
    const auto child = ::fork();
    if (child == 0) {
      const rlimit limit{65'536, 65'536};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      ::signal(SIGXFSZ, SIG_IGN);
      const int log = ::open(directory_.file("log").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
      ::dup2(log, STDERR_FILENO);
      ::execl(PROBEBOX_PROGRAM, PROBEBOX_PROGRAM, "export", packed.c_str(), "--force", "-o", out.c_str(), nullptr);
      ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 2);
    EXPECT_EQ(std::filesystem::file_size(out), 9U) << "what was there before stays";
  }
  for (const auto& entry : std::filesystem::directory_iterator{std::filesystem::path{table}.parent_path()})
    EXPECT_THAT(entry.path().string(), testing::Not(testing::HasSubstr(".part-")));
}

TEST_F(RunningProgram, SaysItsVersion) {
  const Program program{{"--version"}, directory_.file("log")};
  EXPECT_EQ(program.wait(), 0);
}

}  // namespace
}  // namespace probebox::command
