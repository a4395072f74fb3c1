#include "host_command.hpp"

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <signal.h>
#include <spawn.h>
#include <sstream>
#include <stdlib.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

namespace probebox::vm {
namespace {

namespace fs = std::filesystem;

// The folders above a work tree may be closed to other users.
std::string program() {
  const fs::path copy = "/tmp/host-command/probebox";
  fs::create_directories(copy.parent_path());
  fs::copy_file(PROBEBOX, copy, fs::copy_options::skip_existing);
  return copy;
}

std::vector<std::string> asUser(HostUser user) {
  if (user == HostUser::root) return {};
  const std::string group = user == HostUser::member_of_plugdev ? "--groups=plugdev" : "--clear-groups";
  return {"setpriv", "--reuid=7629", "--regid=7629", group, "--inh-caps=-all", "--bounding-set=-all", "--no-new-privs"};
}

std::string contentOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream{path}.rdbuf();
  return text.str();
}

}  // namespace

HostCommand::HostCommand(HostUser user, const std::vector<std::string>& arguments) {
  std::string pattern = "/tmp/host-command-XXXXXX";
  folder_ = ::mkdtemp(pattern.data());
  auto words = asUser(user);
  words.push_back(program());
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, (folder_ + "/out").c_str(), kNew, 0644);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, (folder_ + "/err").c_str(), kNew, 0644);
  errno = posix_spawnp(&pid_, pointers[0], &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (errno != 0) throw std::system_error{errno, std::generic_category(), words.front()};
}

HostCommand::~HostCommand() {
  signal(SIGKILL);
  status();
}

void HostCommand::signal(int number) const {
  if (status_ < 0) ::kill(pid_, number);
}

int HostCommand::status() {
  if (status_ >= 0) return status_;
  int ended = 0;
  ::waitpid(pid_, &ended, 0);
  status_ = WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
  return status_;
}

std::string HostCommand::out() const {
  return contentOf(folder_ + "/out");
}

std::string HostCommand::err() const {
  return contentOf(folder_ + "/err");
}

std::vector<nlohmann::json> HostCommand::objects() const {
  std::vector<nlohmann::json> all;
  std::istringstream lines{out()};
  for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
  return all;
}

Told tell(HostUser user, const std::vector<std::string>& arguments) {
  HostCommand command{user, arguments};
  const int status = command.status();
  return {status, command.err(), command.objects()};
}

}  // namespace probebox::vm
