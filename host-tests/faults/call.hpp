#pragma once
#include <cstddef>
#include <cstdint>
#include <linux/seccomp.h>
#include <optional>
#include <string>
#include <vector>

namespace probebox::faults {

// A system call on a file that a process is about to make.
struct Call {
  enum class Kind : std::uint8_t { open, read, write, sync, truncate, rename, link, remove, make_folder };
  Kind kind{};
  std::string path;           // absolute
  std::string to{};           // of a rename or a link
  bool creates{};             // O_CREAT
  bool truncates{};           // O_TRUNC
  std::uint64_t offset{};     // of a write
  std::vector<char> bytes{};  // of a write
  std::uint64_t size{};       // of a truncation
  int descriptor{-1};         // of the process; -1: the call has a path
  bool at_offset{};           // a write that moves no file position
};

std::string describe(const Call& call);

// Numbers of all system calls that decode() knows.
const std::vector<int>& fileCalls();

// Reads what the stopped process asks for. Nothing: not about a file with a name, or not one of fileCalls().
std::optional<Call> decode(const seccomp_notif& asked);

}  // namespace probebox::faults
