#pragma once
#include <string_view>

namespace probebox::report {

// What a reader looks up about a method: its name in words, and where its equations stand.
struct MethodFacts {
  std::string_view method;
  std::string_view title;
  std::string_view equations;  // of docs/metrology.md
  std::string_view source;     // the patent
};

// Of an unknown method: its name, and nothing else.
MethodFacts factsOf(std::string_view method);

}  // namespace probebox::report
