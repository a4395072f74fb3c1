#pragma once
#include <sys/wait.h>
#include <unistd.h>

namespace probebox::support {

// Runs `check` in a child process, which may limit itself without harm to the other tests.
template <class Check>
bool holdsInChild(Check check) {
  const auto child = ::fork();
  if (child == 0) ::_exit(check() ? 0 : 1);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace probebox::support
