#include "box_process.hpp"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <signal.h>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include "box_user.hpp"
#include "fail.hpp"

namespace probebox::vm {
namespace {

// A guest has one box at a time.
const std::filesystem::path kFolder = "/tmp/box";

void giveToBoxUser(const std::filesystem::path& path) {
  if (chown(path.c_str(), kBoxUser, kBoxGroup) != 0) fail(path);
}

std::filesystem::path copyOf(const std::filesystem::path& program) {
  const auto copy = kFolder / "bin" / program.filename();
  std::filesystem::create_directories(copy.parent_path());
  std::filesystem::copy_file(program, copy, std::filesystem::copy_options::update_existing);
  return copy;
}

// A command of the box's user; its output goes to `log`. As probeboxd.service allows, it may lock its memory, so that it
// does not wait for pages that 9p brings from this machine. It may not have real-time priority: the one processor of the
// guest also makes the pulses, which have to be on time whatever the box does.
pid_t spawnAsBoxUser(const std::vector<std::string>& command, const std::filesystem::path& log) {
  std::vector<std::string> words{"prlimit",
                                 "--memlock=unlimited",
                                 "setpriv",
                                 "--reuid=" + std::to_string(kBoxUser),
                                 "--regid=" + std::to_string(kBoxGroup),
                                 "--clear-groups",
                                 "--inh-caps=-all",
                                 "--bounding-set=-all",
                                 "--no-new-privs"};
  words.insert(words.end(), command.begin(), command.end());
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t pid = 0;
  errno = posix_spawnp(&pid, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (errno != 0) fail(words.front());
  return pid;
}

std::string contentOf(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream{path}.rdbuf();
  return text.str();
}

}  // namespace

Ended runAsBoxUser(const std::vector<std::string>& command) {
  std::filesystem::create_directories(kFolder);
  const auto log = kFolder / "output";
  std::filesystem::remove(log);
  int status = 0;
  waitpid(spawnAsBoxUser(command, log), &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contentOf(log)};
}

Ended probebox(const std::vector<std::string>& arguments) {
  std::vector<std::string> command{copyOf(PROBEBOX)};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runAsBoxUser(command);
}

BoxProcess::BoxProcess(const std::filesystem::path& board) : folder_{kFolder} {
  std::filesystem::remove_all(folder_);
  std::filesystem::create_directories(folder_ / "state");
  giveToBoxUser(folder_ / "state");
  std::filesystem::copy(board, folder_ / "board", std::filesystem::copy_options::recursive);
}

BoxProcess::~BoxProcess() {
  kill(SIGTERM);
}

void BoxProcess::start(const std::vector<std::string>& more) {
  std::vector<std::string> command{copyOf(PROBEBOXD), "--board", board(), "--state", folder_ / "state"};
  command.insert(command.end(), more.begin(), more.end());
  pid_ = spawnAsBoxUser(command, folder_ / "log");
}

bool BoxProcess::running() {
  if (pid_ <= 0) return false;
  if (waitpid(pid_, nullptr, WNOHANG) == 0) return true;
  pid_ = 0;
  return false;
}

void BoxProcess::kill(int signal) {
  if (pid_ <= 0) return;
  ::kill(pid_, signal);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
}

void BoxProcess::freeze() const {
  ::kill(pid_, SIGSTOP);
  // Stopped, all of its threads, before this returns.
  siginfo_t info{};
  waitid(P_PID, static_cast<id_t>(pid_), &info, WSTOPPED);
}

void BoxProcess::thaw() const {
  ::kill(pid_, SIGCONT);
}

std::string BoxProcess::log() const {
  return contentOf(folder_ / "log");
}

}  // namespace probebox::vm
