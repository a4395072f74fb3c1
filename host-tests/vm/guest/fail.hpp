#pragma once
#include <cerrno>
#include <string>
#include <system_error>

namespace probebox::vm {

// Throws what the last system call complained of.
[[noreturn]] inline void fail(const std::string& what) {
  throw std::system_error{errno, std::generic_category(), what};
}

}  // namespace probebox::vm
