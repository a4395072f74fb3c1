#include <array>
#include <atomic>
#include <fcntl.h>
#include <iostream>
#include <poll.h>
#include <signal.h>
#include <string>
#include <sys/ioctl.h>
#include <unistd.h>
#include <vector>

#include "tools/probebox/cli/exit_status.hpp"
#include "tools/probebox/cli/interruptible_input.hpp"
#include "tools/probebox/run.hpp"

namespace {

std::atomic<bool> interrupted{false}, ends_at_once{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the signal handler may set it");

// The first Ctrl-C ends the command in order; a second one, or one where nothing is in disorder, ends it at once.
void onInterrupt(int signal_number) {
  if (interrupted.exchange(true)) _exit(128 + signal_number);
  if (ends_at_once) _exit(static_cast<int>(probebox::command::ExitStatus::interrupted));
}

void catchSignals() {
  struct sigaction action {};
  action.sa_handler = onInterrupt;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);  // a reader that goes away shows as a failed write
}

// Otherwise the next file or connection that is opened would get its number, and what is meant for a person with it.
// Nothing can be written to this one, as to one that is closed.
void occupyClosedStreams() {
  for (int opened = open("/dev/null", O_RDONLY); opened >= 0; opened = open("/dev/null", O_RDONLY)) {
    if (opened <= STDERR_FILENO) continue;
    close(opened);
    return;
  }
}

std::size_t terminalColumns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

// A whole line of the terminal is there to be read, and is now read. One that is somebody else's, because this program
// runs in the background, stays: to read it would stop the program in the middle of a run.
bool enterPressed() {
  if (tcgetpgrp(STDIN_FILENO) != getpgrp()) return false;
  pollfd keyboard{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (poll(&keyboard, 1, 0) != 1 || (keyboard.revents & POLLIN) == 0) return false;
  std::array<char, 256> line{};
  return read(STDIN_FILENO, line.data(), line.size()) > 0;
}

// A pipe without a reader; a full disk is none.
bool readerGone() {
  pollfd output{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  return poll(&output, 1, 0) == 1 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

}  // namespace

int main(int count, char** words) {
  occupyClosedStreams();
  catchSignals();
  std::ios::sync_with_stdio(false);
  const std::vector<std::string> arguments{words + 1, words + count};
  probebox::command::InterruptibleInput input{STDIN_FILENO, interrupted};
  std::istream standard_input{&input};
  probebox::command::Streams streams{
      standard_input,    std::cout,  std::cerr, isatty(STDOUT_FILENO) == 1, isatty(STDERR_FILENO) == 1,
      terminalColumns(), interrupted};
  streams.reader_gone = readerGone;
  streams.ends_at_once = &ends_at_once;
  if (isatty(STDIN_FILENO) == 1) streams.enter_pressed = enterPressed;
  return static_cast<int>(probebox::command::run(arguments, streams));
}
