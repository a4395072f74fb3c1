#pragma once
#include <string_view>

namespace probebox::report {

// Describes in one phrase the quantity that values about a subject measure, for a page that is read without the manual;
// empty for a subject that has the name of its method.
std::string_view measurandOf(std::string_view subject);

}  // namespace probebox::report
