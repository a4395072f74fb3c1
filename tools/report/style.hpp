#pragma once
#include <string_view>

namespace probebox::report {

// Style sheet of a page: a light and a dark scheme on the screen, A4 with two pictures to a row on paper. Colours are
// variables, which the pictures use as well.
std::string_view style();

}  // namespace probebox::report
