#include "block_words.hpp"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace probebox::scenario {

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::map<char, std::string> wordsOf(const std::string& text) {
  std::map<char, std::string> words;
  std::istringstream all{text};
  for (std::string word; all >> word;) {
    const std::size_t from = word.size() > 1 && word[1] == '=' ? 2 : 1;
    if (word[0] == 'G' && words.contains('G')) continue;  // G153
    words[word[0]] = word.substr(from);
  }
  return words;
}

std::vector<std::string> codesOf(const std::string& text) {
  std::vector<std::string> codes;
  std::istringstream all{text};
  for (std::string word; all >> word;) {
    if (word[0] == 'G') codes.push_back(word.substr(1));
  }
  return codes;
}

}  // namespace probebox::scenario
