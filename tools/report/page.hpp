#pragma once
#include <span>
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// One HTML document about these subjects, in their order: everything is inside it, nothing is fetched, no script runs,
// and it prints on A4. version: of the program that writes it.
std::string page(std::span<const Subject> subjects, const std::string& version);

}  // namespace probebox::report
