// Writes the tables of methods in docs/metrology.md. `methods_page FILE` puts them between their markers in the file;
// `methods_page --check FILE` fails when the file says something else.
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "tools/case/method_text.hpp"

namespace {

// The page with the text between "<!-- NAME -->" and "<!-- end of NAME -->" replaced; nothing without these lines.
std::optional<std::string> replaced(const std::string& page, const std::string& name, const std::string& text) {
  const std::string begin = "<!-- " + name + " -->\n";
  const auto from = page.find(begin);
  const auto to = page.find("<!-- end of " + name + " -->\n");
  if (from == std::string::npos || to == std::string::npos || to < from) return std::nullopt;
  return page.substr(0, from + begin.size()) + text + page.substr(to);
}

}  // namespace

int main(int argc, char** argv) {
  const bool check = argc == 3 && std::string_view{argv[1]} == "--check";
  if (argc != 2 && !check) {
    std::cerr << "usage: methods_page [--check] FILE\n";
    return 2;
  }
  const char* file = argv[argc - 1];
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  auto page = replaced(text.str(), "methods", probebox::casefolder::methodTables());
  if (page) page = replaced(*page, "type B keys", probebox::casefolder::typeBTable());
  if (!page) {
    std::cerr << file << " lacks the markers <!-- methods --> and <!-- type B keys --> with their ends\n";
    return 1;
  }
  if (check) {
    if (*page == text.str()) return 0;
    std::cerr << file << " is stale; run: cmake --build build --target methods-page\n";
    return 1;
  }
  return std::ofstream{file} << *page ? 0 : 1;
}
