#pragma once
#include <span>
#include <string>

#include "tools/report/subject.hpp"

namespace probebox::report {

// Writes one HTML document about these subjects, in their order. It is self-contained, has no scripts, and prints on
// A4. version: of the program that writes it.
std::string page(std::span<const Subject> subjects, const std::string& version);

}  // namespace probebox::report
