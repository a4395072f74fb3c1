#pragma once
#include <map>
#include <string>
#include <vector>

// Words of a line of a program for a control.
namespace probebox::scenario {

std::string upper(std::string text);
// Words of a block: letter and text up to the next word; "X=" of Siemens counts as X.
std::map<char, std::string> wordsOf(const std::string& text);
// The words that begin with G, without it.
std::vector<std::string> codesOf(const std::string& text);

}  // namespace probebox::scenario
