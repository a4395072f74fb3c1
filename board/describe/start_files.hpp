#pragma once
#include <string_view>

namespace probebox::board {

// Returns the text of a file of board/start, the template for a new board; empty when there is no such file.
std::string_view startFile(std::string_view file_name);

}  // namespace probebox::board
