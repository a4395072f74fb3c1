#pragma once
#include <string>
#include <string_view>

namespace probebox::report {

// Text as HTML and SVG hold it: & < > " ' as entities, bytes that no XML may hold (controls, broken UTF-8) as U+FFFD.
std::string escaped(std::string_view text);

// <name>content</name>, the content escaped.
std::string element(std::string_view name, std::string_view text);

}  // namespace probebox::report
