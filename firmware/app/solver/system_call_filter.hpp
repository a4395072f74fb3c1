#pragma once

namespace probebox::app {

// Restricts this process to the system calls of a calculation: memory, read and write of descriptors that are open, and
// its end. Any other one, as for a file, a socket, a process or memory with code, kills it by SIGSYS. Call after
// PR_SET_NO_NEW_PRIVS. False: this kernel or processor has no such filter (seccomp), and nothing is restricted.
bool allowOnlyCalculation();

}  // namespace probebox::app
