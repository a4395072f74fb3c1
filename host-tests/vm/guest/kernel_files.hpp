#pragma once
#include <string>
#include <string_view>

// Small files of the kernel: configfs and sysfs. What it refuses is thrown as std::system_error with the file's name.
namespace probebox::vm {

void writeTo(const std::string& path, std::string_view text);
// The first line; empty when there is none.
std::string readFrom(const std::string& path);

}  // namespace probebox::vm
