#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"

// Lets a command find the boxes on this computer: each daemon keeps a small file <pid>.uri with one URI per line. The
// file does not prove that the daemon still runs.
namespace probebox::io::rendezvous {

struct Announcement {
  int pid{};
  std::vector<std::string> uris;
};

// Folder named by PROBEBOX_RENDEZVOUS; nullopt when unset or empty. It replaces all other folders and the default
// address, for example in tests.
std::optional<std::filesystem::path> chosen();

// Folders of announcements, in order of preference: chosen() only, if set; otherwise $XDG_RUNTIME_DIR/probebox,
// /run/probebox, /tmp/probebox-<uid>.
std::vector<std::filesystem::path> directories();

// The first folder that this process can write to; created if missing.
Outcome<std::filesystem::path> directory();

// Writes <pid>.uri atomically and returns its path.
Outcome<std::filesystem::path> announce(int pid, const std::vector<std::string>& uris);

// Removes <pid>.uri if it exists.
void withdraw(int pid);

// Announcements of existing processes, by process number. Unreadable files are ignored.
std::vector<Announcement> listed();

}  // namespace probebox::io::rendezvous
