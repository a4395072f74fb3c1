// The program in the background of a terminal that has a person's keys.
#include <csignal>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fake_box.hpp"

namespace probebox::command {
namespace {

constexpr int kStopped = 99;

// `probebox calibrate &` of a shell: a process group that the terminal does not belong to. Its exit status, or
// kStopped.
int calibrateInTheBackground(const std::string& uri) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::setpgid(0, 0);
    ::execl(PROBEBOX_PROGRAM, PROBEBOX_PROGRAM, "-u", uri.c_str(), "calibrate", "delay-multi-speed", nullptr);
    ::_exit(127);
  }
  int status = 0;
  ::waitpid(child, &status, WUNTRACED);
  if (!WIFSTOPPED(status)) return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  ::kill(child, SIGKILL);
  ::waitpid(child, &status, 0);
  return kStopped;
}

// Who types in the foreground means somebody else. To read it would have the kernel stop the program in mid-run.
TEST(InTheBackground, ACalibrationGoesOnWhateverIsTyped) {
  const FakeBox box;
  int terminal = -1;
  const pid_t shell = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(shell, 0);
  if (shell == 0) ::_exit(calibrateInTheBackground(box.uri()));
  ASSERT_EQ(::write(terminal, "\n\n\n", 3), 3);
  char shown[4096];
  while (::read(terminal, shown, sizeof shown) > 0) {  // until the terminal is closed
  }
  int status = 0;
  ::waitpid(shell, &status, 0);
  ::close(terminal);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0) << (WEXITSTATUS(status) == kStopped ? "stopped by SIGTTIN" : "");
}

}  // namespace
}  // namespace probebox::command
