#include "recording.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <fcntl.h>
#include <fstream>
#include <signal.h>
#include <spawn.h>
#include <string>
#include <sys/wait.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

constexpr const char* kRecording = "/tmp/recording.pbx";
constexpr const char* kSummary = "/tmp/recording.json";
constexpr const char* kProgress = "/tmp/recording.log";

}  // namespace

Recording::Recording(int seconds) {
  std::remove(kRecording);
  std::vector<std::string> words{
      PROBEBOX, "-u", "usb", "record", "--json", "--force", "--for", std::to_string(seconds), "-o", kRecording};
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, kProgress, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, kSummary, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int code = posix_spawn(&pid_, PROBEBOX, &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (code != 0) throw std::system_error{code, std::generic_category(), PROBEBOX};
}

Recording::~Recording() {
  if (pid_ > 0) end(SIGKILL);
}

bool Recording::running() const {
  for (int tries = 0; tries < 1000; ++tries, std::this_thread::sleep_for(20ms)) {
    std::ifstream file{kRecording, std::ios::ate};
    if (file && file.tellg() > 30'000) return true;
  }
  return false;
}

void Recording::signal(int number) const {
  kill(pid_, number);
}

void Recording::end(int number) {
  kill(pid_, number);
  waitpid(std::exchange(pid_, 0), nullptr, 0);
}

nlohmann::json Recording::summary() {
  int status = 0;
  waitpid(std::exchange(pid_, 0), &status, 0);
  std::ifstream file{kSummary};
  std::string last;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty()) last = line;
  }
  auto object = nlohmann::json::parse(last, nullptr, false);
  if (!object.is_object()) object = {{"no_summary", last}};
  object["exit_status"] = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return object;
}

}  // namespace probebox::vm
