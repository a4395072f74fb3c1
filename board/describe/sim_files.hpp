#pragma once
#include <string_view>

namespace probebox::board {

// Returns the text of a file of board/sim at the time of the build; empty when there is no such file.
std::string_view simFile(std::string_view file_name);
// The same of board/sim-lathe, which has the files of board/sim where it has none of its own.
std::string_view simLatheFile(std::string_view file_name);

}  // namespace probebox::board
