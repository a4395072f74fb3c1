#pragma once
#include <string_view>

namespace probebox::board {

// The text of a file of board/sim, as it was when the program was built; empty when there is no such file.
std::string_view simFile(std::string_view file_name);

}  // namespace probebox::board
