#pragma once
#include <string>
#include <string_view>

namespace probebox::report {

// Sets text for a page (units as casefolder::typeset has them) and escapes it for HTML and SVG: & < > " ' as entities,
// bytes that XML forbids (controls, broken UTF-8) as U+FFFD.
std::string escaped(std::string_view plain);

// <name>content</name>, the content escaped.
std::string element(std::string_view name, std::string_view text);

}  // namespace probebox::report
