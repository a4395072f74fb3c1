#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host-tests/faults/call.hpp"

// Runs a function in a process of its own and decides about each of its system calls on the files of one folder, by the
// kernel's seccomp notifications: the process waits in the call meanwhile.
namespace probebox::faults {

struct Decision {
  enum class What { pass, fail, shorten, kill } what{What::pass};
  int error{};  // of fail
};

// What the process says to its supervisor, one line a call; a line is there even if the process dies right after.
using Say = std::function<void(std::string_view line)>;

struct Ended {
  bool killed{};  // by a decision
  int status{};   // as waitpid() has it
  bool hung{};    // it took longer than kPatience and was killed for it
  std::vector<std::string> said;
};

inline constexpr std::chrono::seconds kPatience{60};

// Why this kernel or its sandbox permits no supervision; empty when it does.
std::string whyNoSupervision();

// Calls on files outside of `folder` pass unseen. Syncs that pass are answered without the disk.
Ended supervise(const std::filesystem::path& folder, const std::function<void(const Say&)>& run,
                const std::function<Decision(const Call&)>& decide);

}  // namespace probebox::faults
