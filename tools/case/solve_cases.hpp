#pragma once
#include <filesystem>
#include <iosfwd>

namespace probebox::casefolder {

// Answers one case of `probebox solve [--json] CASE...`: one JSON object in a line, or a short table for a person. A
// folder that cannot be read is reported on `err` (with JSON also on `out`). Returns the exit status: 0 solved; 1
// refused; 2 cannot be read.
int solveCase(const std::filesystem::path& folder, bool json, std::ostream& out, std::ostream& err);

}  // namespace probebox::casefolder
