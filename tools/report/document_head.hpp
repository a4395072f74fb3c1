#pragma once
#include <string>
#include <string_view>

namespace probebox::report {

// The beginning of an HTML document with the style sheet of all pages and rules of its own, up to <body>.
std::string documentHead(const std::string& title, std::string_view own_style = {});

}  // namespace probebox::report
