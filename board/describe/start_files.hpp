#pragma once
#include <string_view>

namespace probebox::board {

// The text of a file of board/start, which a new board starts with; empty when there is no such file.
std::string_view startFile(std::string_view file_name);

}  // namespace probebox::board
