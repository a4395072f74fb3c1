#include "firmware/app/solver/solver_process.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <signal.h>
#include <spawn.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace probebox::app {
namespace {

metrology::Refusal ended(const std::string& how) {
  return {"solver-ended", "the solver " + how +
                              " on this case, and the box goes on without a result: save the case and report it, or "
                              "solve it on a computer (probebox solve)"};
}

io::Descriptor memoryFile(const char* name) {
  return io::Descriptor{memfd_create(name, MFD_CLOEXEC)};
}

bool fill(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const auto count = write(descriptor, text.data(), text.size());
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return lseek(descriptor, 0, SEEK_SET) == 0;
}

std::optional<std::string> contentOf(int descriptor, std::size_t most) {
  struct stat about {};
  if (fstat(descriptor, &about) != 0 || about.st_size < 0 || static_cast<std::size_t>(about.st_size) > most)
    return std::nullopt;
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  for (std::size_t at = 0; at < text.size();) {
    const auto count = pread(descriptor, text.data() + at, text.size() - at, static_cast<off_t>(at));
    if (count <= 0) return std::nullopt;
    at += static_cast<std::size_t>(count);
  }
  return text;
}

// Standard input and output are the two files, standard error is the daemon's, all else is closed; signals are as in a
// new program, and those of a terminal reach the daemon alone. 0, or why there is no process.
int spawn(pid_t& child, const std::string& program, const std::string& limits, int input, int output) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t signals;
  sigemptyset(&signals);
  posix_spawnattr_setsigmask(&attributes, &signals);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  std::string name = "probeboxd-solver";
  std::string option = "--solver";
  std::string argument = limits;
  std::array<char*, 4> arguments{name.data(), option.data(), argument.data(), nullptr};
  const int failed = posix_spawn(&child, program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  return failed;
}

}  // namespace

SolverProcess::SolverProcess(std::filesystem::path program, SolverLimits limits)
    : program_{std::move(program)}, limits_{limits} {}

void SolverProcess::start(const metrology::Dataset& dataset, std::string_view text) {
  cancel();
  if (program_.empty()) {
    at_once_ = metrology::solve(dataset);
    return;
  }
  if (auto refusal = launch(text)) at_once_ = *refusal;
}

std::optional<metrology::Refusal> SolverProcess::launch(std::string_view text) {
  io::Descriptor input = memoryFile("case");
  io::Descriptor output = memoryFile("answer");
  if (!input || !output || !fill(input.get(), text))
    return ended(std::string{"got no memory to begin ("} + std::strerror(errno) + ")");
  if (const int failed = spawn(child_, program_.string(), toArgument(limits_), input.get(), output.get())) {
    child_ = 0;
    return ended(std::string{"could not be started ("} + std::strerror(failed) + ")");
  }
  answer_ = std::move(output);
  end_ = io::Descriptor{static_cast<int>(syscall(SYS_pidfd_open, child_, 0))};
  until_ = std::chrono::steady_clock::now() + limits_.patience;
  return std::nullopt;
}

std::optional<metrology::Solved> SolverProcess::poll() {
  if (child_ == 0) return std::exchange(at_once_, std::nullopt);
  int status = 0;
  const pid_t gone = waitpid(child_, &status, WNOHANG);
  if (gone == 0) {
    if (std::chrono::steady_clock::now() < until_) return std::nullopt;
    cancel();
    return tooLong(limits_);
  }
  child_ = 0;
  end_.close();
  auto answer = gone < 0 ? metrology::Solved{ended("got lost")} : answerOf(status);
  answer_.close();
  return answer;
}

metrology::Solved SolverProcess::answerOf(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU) return tooLong(limits_);
    return ended("ended by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")");
  }
  if (const int code = WEXITSTATUS(status); code != 0) return ended("ended with status " + std::to_string(code));
  const auto text = contentOf(answer_.get(), limits_.answer_bytes);
  if (!text) return ended("gave an answer that is too large");
  auto answer = decodeAnswer(*text);
  if (!answer) return ended("gave an answer that cannot be read (" + answer.error().what + ")");
  return std::move(answer).value();
}

void SolverProcess::cancel() {
  at_once_.reset();
  if (child_ == 0) return;
  kill(-child_, SIGKILL);  // its whole group: it is the leader
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = 0;
  end_.close();
  answer_.close();
}

}  // namespace probebox::app
