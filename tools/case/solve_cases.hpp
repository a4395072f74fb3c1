#pragma once
#include <filesystem>
#include <iosfwd>
#include <span>

namespace probebox::casefolder {

// Runs `probebox solve [--json] CASE...` after its command line was parsed. Answers go to `out` in the order given: one
// JSON object per line, or a short table for a person. Unreadable folders are reported on `err` (with JSON also on
// `out`) and the rest is still solved. Returns the exit status: 0 every case solved; 1 at least one refused; 2 (wins
// over 1) a folder that cannot be read, or none.
int solveCases(std::span<const std::filesystem::path> folders, bool json, std::ostream& out, std::ostream& err);

}  // namespace probebox::casefolder
