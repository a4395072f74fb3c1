#pragma once
#include <string>

namespace probebox::report {

// The shortest digits that read back as the same double.
std::string allDigits(double value);
// At most so many significant digits; -0 as 0.
std::string shortly(double value, int digits);

}  // namespace probebox::report
