#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

// Reads a text as the description of that name, such as "machine.toml". Returns the problems, one a line and each with
// file and line, or nothing where it is accepted. Aborts where a problem names no line, or would not print on a
// terminal.
std::string problemsOf(std::string_view file_name, std::string_view text);

// What the fuzzer feeds: the first byte chooses which description the others are.
int feedDescription(const std::uint8_t* data, std::size_t size);
