#pragma once
#include <string_view>

namespace probebox::board {

// Returns the text of a file of board/sim at the time of the build; empty when there is no such file.
std::string_view simFile(std::string_view file_name);

}  // namespace probebox::board
