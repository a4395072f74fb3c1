#pragma once
#include <string_view>

namespace probebox::report {

// What the values about a subject are of, in a sentence for a page that is read without the manual; empty for a subject
// that is named by its method.
std::string_view measurandOf(std::string_view subject);

}  // namespace probebox::report
