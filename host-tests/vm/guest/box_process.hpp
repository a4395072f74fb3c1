#pragma once
#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

namespace probebox::vm {

// Runs a program as the box's user, without a privilege and without a way to get one, and waits for its end.
struct Ended {
  int status{};
  std::string output;  // stdout and stderr
};
Ended runAsBoxUser(const std::vector<std::string>& command);

// probeboxd as a service manager would start it: the box's user, no privilege. Its program and its board's description
// are copied first, because the folders above a work tree may be closed to that user.
class BoxProcess {
 public:
  // board: a folder of descriptions.
  explicit BoxProcess(const std::filesystem::path& board);
  ~BoxProcess();
  BoxProcess(const BoxProcess&) = delete;
  BoxProcess& operator=(const BoxProcess&) = delete;

  // With these arguments beside --board and --state. It may be started again after kill().
  void start(const std::vector<std::string>& more = {});
  bool running();
  // Sends the signal and waits for the end.
  void kill(int signal);
  // SIGSTOP and SIGCONT: nothing runs in it meanwhile.
  void freeze() const;
  void thaw() const;

  pid_t pid() const { return pid_; }
  // The box's own copy, to be changed before start().
  std::filesystem::path board() const { return folder_ / "board"; }
  std::string log() const;

 private:
  std::filesystem::path folder_;
  pid_t pid_{};
};

// The command probebox against a running box, as the box's user.
Ended probebox(const std::vector<std::string>& arguments);

}  // namespace probebox::vm
