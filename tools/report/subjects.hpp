#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/report/subject.hpp"

namespace probebox::report {

// What a case folder holds, solved; or what a file of answers holds, as `probebox solve --json` writes it: one object
// or one a line. The pictures of an answer come from its case folder where that is still there. Errors name the path,
// the line and the remedy: neither folder nor file, not JSON, no answer of a solve, a case that could not be read.
Outcome<std::vector<Subject>> subjectsIn(const std::filesystem::path& path);

// Solves the dataset of a kept result again for its residuals, which are not kept. False, and no residuals, where the
// answer is another one now: it was solved by another version, or its dataset is not the whole.
bool recallResiduals(Subject& subject);

// The answers in such a text.
Outcome<std::vector<Subject>> subjectsOf(std::string_view text, const std::string& name);

}  // namespace probebox::report
