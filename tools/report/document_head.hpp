#pragma once
#include <string>

namespace probebox::report {

// The beginning of an HTML document with the style sheet of all pages, up to <body>.
std::string documentHead(const std::string& title);

}  // namespace probebox::report
