#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/report/subject.hpp"

namespace probebox::report {

// Solves a case folder, or reads a file of answers as `probebox solve --json` writes it: one JSON object, or one per
// line. Plots of an answer need its case folder to exist still. Errors name path, line and remedy: neither folder nor
// file, not JSON, not an answer of solve, an unreadable case.
Outcome<std::vector<Subject>> subjectsIn(const std::filesystem::path& path);

// Solves the dataset of a stored result again to get its residuals, which are not stored. Returns false, without
// residuals, if the values now differ: another version solved it, or its dataset is incomplete.
bool recallResiduals(Subject& subject);

// Reads the answers in the text of such a file.
Outcome<std::vector<Subject>> subjectsOf(std::string_view text, const std::string& name);

}  // namespace probebox::report
