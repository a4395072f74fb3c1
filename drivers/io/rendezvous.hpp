#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"

// How a command finds the boxes that run on this computer: each daemon keeps one small file, <pid>.uri, with one URI a
// line. A file is an invitation to ask, never a proof: the daemon may have been killed.
namespace probebox::io::rendezvous {

struct Announcement {
  int pid{};
  std::vector<std::string> uris;
};

// The folder that the environment variable PROBEBOX_RENDEZVOUS names; nothing when it is unset or empty. Who sets it,
// such as a test, meets only boxes that announce themselves there: no other folder is read or written, and nobody shall
// ask the usual address.
std::optional<std::filesystem::path> chosen();

// Where daemons may have announced themselves, in order of preference: chosen() alone when there is one; otherwise
// $XDG_RUNTIME_DIR/probebox, /run/probebox, /tmp/probebox-<uid>.
std::vector<std::filesystem::path> directories();

// The first of them that this process can write to; it is made when missing.
Outcome<std::filesystem::path> directory();

// Writes <pid>.uri whole (a reader never sees half of it), and returns its path.
Outcome<std::filesystem::path> announce(int pid, const std::vector<std::string>& uris);

// Removes <pid>.uri; nothing happens when there is none.
void withdraw(int pid);

// All announcements of processes that still exist, by process number. Files that cannot be read are passed over.
std::vector<Announcement> listed();

}  // namespace probebox::io::rendezvous
