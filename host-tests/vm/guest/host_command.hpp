#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <sys/types.h>
#include <vector>

namespace probebox::vm {

// Who sits at the host's side of the guest. plugdev: those to whom the rule for hosts gives boxes on USB.
enum class HostUser { member_of_plugdev, stranger, root };

// The command probebox on the host's side, while the test does something else.
class HostCommand {
 public:
  HostCommand(HostUser user, const std::vector<std::string>& arguments);
  ~HostCommand();  // kills it
  HostCommand(const HostCommand&) = delete;
  HostCommand& operator=(const HostCommand&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  // Its exit status (128 + signal when it was killed); waits for it.
  int status();
  // What it has said so far.
  std::string out() const;
  std::string err() const;
  // The JSON objects of out(), one a line.
  std::vector<nlohmann::json> objects() const;

 private:
  std::string folder_;
  pid_t pid_{};
  int status_{-1};
};

// Waits for its end.
struct Told {
  int status{};
  std::string err;
  std::vector<nlohmann::json> objects;
};
Told tell(HostUser user, const std::vector<std::string>& arguments);

}  // namespace probebox::vm
