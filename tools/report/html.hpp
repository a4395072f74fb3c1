#pragma once
#include <string>
#include <string_view>

namespace probebox::report {

// Escapes text for HTML and SVG: & < > " ' as entities, bytes that XML forbids (controls, broken UTF-8) as U+FFFD.
std::string escaped(std::string_view text);

// <name>content</name>, the content escaped.
std::string element(std::string_view name, std::string_view text);

}  // namespace probebox::report
