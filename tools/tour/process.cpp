#include "tools/tour/process.hpp"

#include <array>
#include <cstring>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace probebox::tour {
namespace {

class FileActions {
 public:
  FileActions() { posix_spawn_file_actions_init(&actions_); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  posix_spawn_file_actions_t* get() { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

Outcome<pid_t> spawn(const std::vector<std::string>& command, FileActions& actions) {
  std::vector<std::string> words = command;
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, arguments[0], actions.get(), nullptr, arguments.data(), environ);
  if (error != 0) return Error{"Cannot start " + command.front() + ": " + std::strerror(error) + "."};
  return pid;
}

}  // namespace

Outcome<Process> Process::start(const std::vector<std::string>& command, const std::string& log) {
  FileActions actions;
  posix_spawn_file_actions_addopen(actions.get(), STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(actions.get(), STDOUT_FILENO, STDERR_FILENO);
  TRY(const auto pid, spawn(command, actions));
  return Process{pid};
}

Process::Process(Process&& other) noexcept : pid_{std::exchange(other.pid_, 0)} {}

Process::~Process() {
  kill(SIGTERM);
}

void Process::kill(int signal) {
  if (pid_ <= 0) return;
  ::kill(pid_, signal);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
}

bool Process::running() {
  if (pid_ <= 0) return false;
  if (waitpid(pid_, nullptr, WNOHANG) == 0) return true;
  pid_ = 0;
  return false;
}

Outcome<std::string> outputOf(const std::vector<std::string>& command) {
  std::array<int, 2> pipe_ends{};
  if (pipe2(pipe_ends.data(), O_CLOEXEC) != 0) return Error{"Cannot make a pipe."};
  FileActions actions;
  posix_spawn_file_actions_adddup2(actions.get(), pipe_ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(actions.get(), pipe_ends[1], STDERR_FILENO);
  const auto pid = spawn(command, actions);
  close(pipe_ends[1]);
  std::string output;
  std::array<char, 4096> buffer{};
  while (pid) {
    const ssize_t got = read(pipe_ends[0], buffer.data(), buffer.size());
    if (got <= 0) break;
    output.append(buffer.data(), static_cast<std::size_t>(got));
  }
  close(pipe_ends[0]);
  if (!pid) return pid.error();
  int status = 0;
  waitpid(*pid, &status, 0);
  if (status != 0) return Error{command.front() + " failed:\n" + output};
  return output;
}

}  // namespace probebox::tour
